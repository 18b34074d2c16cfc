//! Programs that are refused: those for turning, and those for controls on which common words have other meanings. In: a program. Out: why it is
//! refused, and what to do.

use super::dialect::Dialect;
use super::program::Program;
use super::{recognise, turning};

/// Why a program is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// What it is.
    pub text: String,
    /// What to do.
    pub help: String,
}

/// Why a program is refused; `None`: it is not. `mill`: the user states that a mill runs it, so signs of turning do not count.
pub fn refusal(program: &Program, mill: bool) -> Option<Refusal> {
    let foreign = program.recognised().cloned().or_else(|| recognise::foreign(program.own_text(), program.dialect()));
    if let Some((found, why)) = foreign.and_then(|found| found.control.refusal().map(|why| (found, why))) {
        let (control, signs) = (found.control.name(), found.why());
        let names: Vec<&str> = Dialect::ALL[1..].iter().map(|dialect| dialect.name()).collect();
        return Some(Refusal {
            text: format!("this is a program for {control} ({signs}), which is not read: {why}"),
            help: format!("post it for a control that is read: {}", names.join(", ")),
        });
    }
    let why = turning::refusal(program).filter(|_| !mill)?;
    let help = "only milling programs are rewritten; if a mill runs this one, say so with --mill";
    Some(Refusal { text: why, help: help.to_owned() })
}
