//! Feedwright for Python. In: bytes and texts. Out: numbers, texts and numpy arrays, by the public functions of the crate and nothing
//! else. `feedwright/__init__.py` reads the files.

use feedwright::{Outcome, Setup};
use numpy::IntoPyArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use std::fmt::Display;

fn refused(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn setup_of(text: &str, folder: &str, model: Option<&str>) -> PyResult<Setup> {
    let setup = Setup::from_toml(text, folder).map_err(refused)?;
    match model {
        None => Ok(setup),
        Some(text) => setup.with_model(text).map_err(refused),
    }
}

/// Loads and times of a program: as programmed, and as written where it was optimised.
#[pyclass(frozen)]
struct Prediction(feedwright::Prediction);

#[pymethods]
impl Prediction {
    /// Time as programmed and as written, as the control realises it, s.
    #[getter]
    fn time_s(&self) -> (f64, f64) {
        self.0.time_s().into()
    }

    /// Is every limit met, and does nothing collide?
    #[getter]
    fn ok(&self) -> bool {
        self.0.outcome() == Outcome::Done
    }

    /// The verdict in one sentence.
    #[getter]
    fn headline(&self) -> &str {
        self.0.headline()
    }

    /// Largest loads: a list of dict with name, unit, tool, limit, before, after.
    #[getter]
    fn loads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for load in self.0.loads() {
            let row = PyDict::new(py);
            row.set_item("name", load.name)?;
            row.set_item("unit", load.unit)?;
            row.set_item("tool", load.tool)?;
            row.set_item("limit", load.limit)?;
            row.set_item("before", load.before)?;
            row.set_item("after", load.after)?;
            list.append(row)?;
        }
        Ok(list)
    }

    /// One value per station of the path, by the names of the columns of `--csv`: numpy arrays of float (nan where there is none);
    /// entry and exit angles, of which a station may have several, are lists of str.
    fn stations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = py.detach(|| self.0.csv());
        let mut lines = table.lines();
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let mut columns: Vec<Vec<&str>> = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, cell) in columns.iter_mut().zip(line.split(',')) {
                column.push(cell);
            }
        }
        let found = PyDict::new(py);
        for (name, cells) in names.into_iter().zip(columns) {
            let number = |cell: &&str| if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() };
            match cells.iter().map(number).collect::<Option<Vec<f64>>>() {
                Some(values) if !["entry_deg", "exit_deg"].contains(&name) => {
                    found.set_item(name, values.into_pyarray(py))?;
                }
                _ => found.set_item(name, cells)?,
            }
        }
        Ok(found)
    }

    /// The summary that the command prints.
    fn summary(&self, name: &str) -> String {
        self.0.summary(name)
    }

    /// The JSON report as text.
    fn json(&self, name: &str) -> String {
        self.0.json(name)
    }
}

/// A program with new feeds.
#[pyclass(frozen)]
struct Optimised {
    #[pyo3(get)]
    prediction: Py<Prediction>,
    program: Option<Vec<u8>>,
}

#[pymethods]
impl Optimised {
    /// The rewritten program; None where it must not run: `prediction.headline` says why.
    #[getter]
    fn program<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        self.program.as_ref().map(|bytes| PyBytes::new(py, bytes))
    }
}

/// What the proof of two programs found.
#[pyclass(frozen, get_all)]
struct Proof {
    holds: bool,
    motions: usize,
    feeds_changed: usize,
    differences: Vec<String>,
}

/// What a measured log says of a model.
#[pyclass(frozen)]
struct Learned(feedwright::Learned);

#[pymethods]
impl Learned {
    /// Names of the effects that the model lacked, in the order found.
    #[getter]
    fn effects(&self) -> Vec<&str> {
        self.0.effects()
    }

    /// Coefficients: names, and numpy arrays of their values and standard errors.
    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.0.coefficients();
        let of = |read: fn(&feedwright::Coefficient) -> f64| all.iter().map(read).collect::<Vec<f64>>();
        let found = PyDict::new(py);
        found.set_item("name", all.iter().map(|one| one.name.as_str()).collect::<Vec<_>>())?;
        found.set_item("unit", all.iter().map(|one| one.unit.as_str()).collect::<Vec<_>>())?;
        found.set_item("value", of(|one| one.value).into_pyarray(py))?;
        found.set_item("std_error", of(|one| one.std_error).into_pyarray(py))?;
        Ok(found)
    }

    /// The process model, for `optimize(…, model=…)`; None where the data support none.
    #[getter]
    fn model(&self) -> Option<String> {
        self.0.model()
    }

    /// The summary that the command prints.
    fn summary(&self) -> String {
        self.0.summary()
    }

    /// The JSON report as text.
    fn json(&self) -> String {
        self.0.json()
    }
}

#[pymodule]
mod _feedwright {
    use super::*;

    #[pymodule_export]
    use super::{Learned, Optimised, Prediction, Proof};

    #[pyfunction]
    fn simulate(py: Python, program: Vec<u8>, setup: &str, folder: &str, model: Option<&str>) -> PyResult<Prediction> {
        py.detach(|| {
            let setup = setup_of(setup, folder, model)?;
            let program = feedwright::parse(program, Some(&setup)).map_err(refused)?;
            feedwright::simulate(&program, &setup).map(Prediction).map_err(refused)
        })
    }

    #[pyfunction]
    fn optimize(py: Python, program: Vec<u8>, setup: &str, folder: &str, model: Option<&str>) -> PyResult<Optimised> {
        let found = py.detach(|| {
            let setup = setup_of(setup, folder, model)?;
            let program = feedwright::parse(program, Some(&setup)).map_err(refused)?;
            feedwright::optimise(&program, &setup).map_err(refused)
        })?;
        Ok(Optimised { prediction: Py::new(py, Prediction(found.prediction))?, program: found.program })
    }

    #[pyfunction]
    fn verify(py: Python, original: Vec<u8>, rewritten: Vec<u8>, setup: Option<&str>, folder: &str) -> PyResult<Proof> {
        py.detach(|| {
            let setup = setup.map(|text| setup_of(text, folder, None)).transpose()?;
            let proof = feedwright::verify(original, rewritten, setup.as_ref()).map_err(refused)?;
            let holds = proof.holds();
            Ok(Proof {
                holds,
                motions: proof.motions,
                feeds_changed: proof.feeds_changed,
                differences: proof.differences,
            })
        })
    }

    #[pyfunction]
    fn learn(py: Python, program: Vec<u8>, log: Vec<u8>, setup: &str, folder: &str) -> PyResult<Learned> {
        py.detach(|| {
            let setup = setup_of(setup, folder, None)?;
            let program = feedwright::parse(program, Some(&setup)).map_err(refused)?;
            feedwright::learn(&program, &log, &setup).map(Learned).map_err(refused)
        })
    }

    /// The console command; returns its exit code.
    #[pyfunction]
    fn main(py: Python, arguments: Vec<std::ffi::OsString>) -> u8 {
        py.detach(|| feedwright::cli::run_with(arguments))
    }
}
