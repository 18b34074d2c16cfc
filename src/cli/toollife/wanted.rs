//! What the regulation of tool life requires of the feeds. In: the present state of the tool, its trend and wear law. Out: a budget of wear or a
//! highest force, or why there is none.

use super::super::error::CliError;
use super::arguments::Method;
use super::now::Now;
use crate::machine::WearLaw;
use crate::report;
use crate::setup::ToolState;
use crate::toollife::exponent::Estimate;
use crate::toollife::regulation::{Regulation, regulate};
use crate::toollife::trend::Trend;

/// What regulation asks of the feeds.
pub struct Wants {
    /// Share of its life that the tool may use in the whole program.
    pub share: Option<f64>,
    /// Most force, N.
    pub force_n: Option<f64>,
    /// May a feed rise above that of the program?
    pub may_rise: bool,
}

/// Asks the regulation.
pub fn wanted(
    now: &Now,
    trend: &Trend,
    law: &WearLaw,
    seen: Option<&Estimate>,
    state: &ToolState,
    method: Method,
    notes: &mut Vec<String>,
) -> Result<Wants, CliError> {
    let why = if law.rate.exponent < 0.0 { "wears it more per metre" } else { "wears it as much per metre" };
    let exponent = report::short(law.rate.exponent);
    match regulate(trend, law, seen, [now.total_m[1], now.rest_m], state.assurance) {
        Regulation::WornOut => Err(CliError::unmet(
            format!(
                "T{} is worn out, or so near to it that no feed keeps the assurance of {}: index {:.1} {} at {:.1} m, end {:.1}",
                state.tool,
                state.assurance,
                trend.at(now.total_m[1]),
                state.index_unit,
                now.total_m[0],
                law.end
            ),
            "nothing was written; change the tool, then `toollife plan --new-tool`",
        )),
        Regulation::AsTheyAre | Regulation::Faster if method == Method::Force => Err(CliError::new(
            format!(
                "the exponent of the law of wear is {exponent}: a slower feed {why}, so lowering the force shortens no wear"
            ),
            "leave --method out; nothing was written",
        )),
        Regulation::AsTheyAre => {
            notes.push(format!(
                "the exponent of its law of wear is {exponent}: a slower feed {why}, so no feed was lowered for its life; none rises either \
                 before readings at two feeds show that a faster one spares it"
            ));
            Ok(Wants { share: None, force_n: None, may_rise: false })
        }
        Regulation::Faster => {
            notes.push(format!(
                "the exponent of its law of wear is {exponent}: a slower feed {why}, so no feed was lowered for its life; by the readings a \
                 faster one spares it, and feeds are as high as the limits allow"
            ));
            Ok(Wants { share: None, force_n: None, may_rise: true })
        }
        Regulation::Pace(_) if method == Method::Force => {
            let force_n = now.force_n.ok_or_else(|| {
                CliError::new("there is no check point ahead to regulate the force at", "leave --method out")
            })?;
            Ok(Wants { share: None, force_n: Some(force_n), may_rise: true })
        }
        Regulation::Pace(pace) => {
            let wear_m = now.done_m[1] + pace * (now.cut_m - now.done_m[0]);
            let share = 1e3 * wear_m / law.life_mm(state.fresh);
            Ok(Wants { share: Some(share.max(f64::MIN_POSITIVE)), force_n: None, may_rise: true })
        }
    }
}
