//! Common weights for measured quantities of different units. In: data, a model. Out: the data with weights divided by
//! the residual variance of each quantity, so that watts and newtons can be added in Σ w r².

use crate::learn::dataset::samples::{Base, Data};
use crate::learn::model::fit::{Fitted, fit};

/// The data weighted by the residual of the base model, fitted without priors.
pub fn whitened(data: &Data) -> Option<Data> {
    let base = Data { base: data.base.iter().cloned().map(|b| Base { prior: None, ..b }).collect(), ..data.clone() };
    Some(weighed_by(data, &fit(&base, &[], 0)?))
}

/// The data weighted by the residual of a model.
pub fn weighed_by(data: &Data, fitted: &Fitted) -> Data {
    let residual = fitted.residuals(data);
    let channels = data.channel.iter().max().map_or(0, |c| c + 1);
    let mut variance = vec![(0.0, 0.0); channels];
    for i in data.used() {
        variance[data.channel[i]].0 += data.weight[i] * residual[i].powi(2);
        variance[data.channel[i]].1 += data.weight[i];
    }
    let of = |c: usize| (variance[c].0 / f64::max(variance[c].1, 1e-300)).max(1e-18);
    let weight = (0..data.len()).map(|i| data.weight[i] / of(data.channel[i])).collect();
    data.with_weights(weight)
}
