//! Coefficients followed over time (Xu, Jerard, Fussell): in windows of the log, factors on the cutting and the edge terms
//! of the base model with their intervals. A slow rise of the edge factor is wear, a jump of the cutting factor chipping.

use super::fit::Fitted;
use super::linear::least_squares;
use super::report::Window;
use super::samples::{Class, Data};
use nalgebra::DMatrix;

/// Windows over the log.
const WINDOWS: usize = 8;

/// Factors in each window; windows that cannot tell cutting from edge are left out.
pub fn windows(data: &Data, base: &Fitted) -> Vec<Window> {
    let cutting: Vec<usize> = data.used().filter(|i| part(data, base, *i, Class::Cutting) > 0.0).collect();
    let size = cutting.len() / WINDOWS;
    if size < 20 {
        return Vec::new();
    }
    cutting.chunks(size).filter(|c| c.len() == size).filter_map(|members| window(data, base, members)).collect()
}

fn part(data: &Data, base: &Fitted, i: usize, class: Class) -> f64 {
    let of = |b: usize| if data.base[b].class == class { base.model.base[b] * data.columns[b][i] } else { 0.0 };
    (0..data.base.len()).map(of).sum()
}

fn window(data: &Data, base: &Fitted, members: &[usize]) -> Option<Window> {
    let x = DMatrix::from_fn(members.len(), 2, |k, j| part(data, base, members[k], [Class::Cutting, Class::Edge][j]));
    let y: Vec<f64> = members.iter().map(|&i| data.reading[i] - part(data, base, i, Class::Tare)).collect();
    let weights: Vec<f64> = members.iter().map(|&i| data.weight[i]).collect();
    let fit = least_squares(&x, &y, &weights)?;
    let time = |i: usize| data.state[i].time_s;
    fit.std_errors.iter().all(|e| e.is_finite()).then(|| Window {
        time_s: [time(members[0]), time(*members.last().unwrap_or(&0))],
        cutting: [fit.coefficients[0], fit.std_errors[0]],
        edge: [fit.coefficients[1], fit.std_errors[1]],
    })
}

/// What the windows say of the edge: slow wear with the time until the edge factor doubles, or a jump.
pub fn said(windows: &[Window]) -> Option<String> {
    let (first, last) = (windows.first()?, windows.last()?);
    let jump = windows
        .windows(2)
        .map(|p| (p[1].cutting[0] - p[0].cutting[0], p[1].time_s[0]))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let error = windows.iter().map(|w| w.cutting[1]).fold(0.0, f64::max);
    if jump.0 > 0.1 && jump.0 > 6.0 * error {
        return Some(format!(
            "the cutting coefficients jump by {:.0} % at {:.0} s: look for a chipped edge",
            100.0 * jump.0,
            jump.1
        ));
    }
    let rise = last.edge[0] - first.edge[0];
    let hours = (last.time_s[1] - first.time_s[0]) / 3600.0;
    (rise > 0.1 && rise > 4.0 * first.edge[1].hypot(last.edge[1])).then(|| {
        format!(
            "the edge coefficients rise by {:.0} % over {:.1} min (wear); at this rate they double in {:.1} min of this program",
            100.0 * rise,
            60.0 * hours,
            60.0 * hours / rise * last.edge[0]
        )
    })
}
