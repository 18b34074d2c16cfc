//! The wear law of a tool. In: a job, one of its tools. Out: its [`Wear`], from what the setup says about the tool and what the process
//! model says about all tools.
//!
//! A tool with a rate of its own wears by that rate alone. One without wears by the model (`flank-wear`), from the index and to the end
//! that the setup gives.

use super::named;
use crate::machine::wear::{ToolWear, Wear, WearLaw, WearRate};
use crate::machine::{Job, Tool};

/// Relative standard deviation of the rate of wear from tool to tool where none is declared: among the three runs of Ibaraki,
/// Shimizu and Matsubara the rates that give their lives (0.233, 0.306, 0.363 N/m) scatter by 0.22 of their mean.
pub const RATE_SCATTER: f64 = 0.22;

/// How a tool wears; `None` where nothing says so.
pub fn of_tool(job: &Job, tool: &Tool) -> Option<Wear> {
    let none = ToolWear { rate: None, end: None, rate_scatter: RATE_SCATTER, end_scatter: 0.0, index: None };
    let said = tool.wear.unwrap_or(none);
    let fresh = job.fresh_index(tool).map(|(fresh, _)| fresh);
    // The model multiplies all edge forces, so an index of 1 for a fresh edge serves even where no coefficient is an index itself.
    let of_model = || Some((of_model(job)?.times(fresh.unwrap_or(1.0)), fresh.unwrap_or(1.0)));
    let (rate, fresh) = said.rate.map_or_else(of_model, |rate| Some((rate, fresh?)))?;
    let law = WearLaw {
        rate,
        end: said.end.unwrap_or(f64::INFINITY),
        rate_scatter: said.rate_scatter,
        end_scatter: said.end_scatter,
    };
    Some(Wear { law, fresh, index: said.index.unwrap_or(fresh) })
}

/// How a tool wears, if the index at the end of its life is known too, which budgets and plans need.
pub fn with_end(job: &Job, tool: &Tool) -> Option<Wear> {
    of_tool(job, tool).filter(|wear| wear.law.end.is_finite())
}

/// The rate that the process model gives to every tool, for an index whose fresh edge is 1.
fn of_model(job: &Job) -> Option<WearRate> {
    job.process.effects.iter().find_map(|used| {
        let effect = named(&used.name)?;
        Some((effect.wear?)(&effect.values(used)?))
    })
}
