//! Errors of force models. In: a key with its value and range. Out: [`ForceError`].

/// Why loads cannot be predicted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ForceError {
    /// A key of the setup, or a word of the program, has a value that no tool or material has.
    #[error("{key} = {value} is out of range: sensible values lie between {low} and {high}")]
    OutOfRange {
        /// Key of the setup file, or word of the program.
        key: String,
        /// Its value, in the unit of the setup file.
        value: f64,
        /// Lowest sensible value.
        low: f64,
        /// Highest sensible value.
        high: f64,
    },
    /// The spindle stands still.
    #[error("the spindle stands still while the tool cuts: give a speed (S) and start it (M3) before this block")]
    SpindleStopped,
    /// A parameter that the model does not have.
    #[error("{key} is no parameter of the force model {model}: `feedwright library models` lists them")]
    UnknownParameter {
        /// Its key.
        key: String,
        /// Name of the model.
        model: &'static str,
    },
    /// A parameter that the model needs is not given.
    #[error("{model} needs {key}: `feedwright library models` and `library effects` say what it is")]
    MissingParameter {
        /// Its key.
        key: &'static str,
        /// Name of the model or effect.
        model: &'static str,
    },
    /// No such effect.
    #[error("unknown effect {name:?}: `feedwright library effects` lists those there are")]
    UnknownEffect {
        /// Its name.
        name: String,
    },
    /// An effect that multiplies edge forces, under a model that has none.
    #[error(
        "{effect} makes edge forces grow, and here the force model {model} has none that could: give its edge terms, or take linear-edge"
    )]
    NoEdgeForce {
        /// Name of the effect.
        effect: &'static str,
        /// Name of the model.
        model: String,
    },
    /// No such force model.
    #[error("unknown force model {name:?}: `feedwright library models` lists those there are")]
    UnknownModel {
        /// Its name.
        name: String,
    },
}

/// One value within its range.
pub(super) fn range(key: &str, value: f64, low: f64, high: f64) -> Result<(), ForceError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ForceError::OutOfRange { key: key.to_owned(), value, low, high })
}
