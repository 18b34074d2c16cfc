//! Variations of a job. In: a job, and a change of its stock, tools or machine. Out: the changed job: diagnosis tries out such changes, and a
//! learned effect makes them for prediction and scheduling.

use super::profile::{Profile, Segment};
use super::tool::{Shape, Tool};
use super::{Axis, Box3, Job, Machine, Runout, Stock, StockShape};
use crate::path::Vec3;
use std::f64::consts::TAU;

impl Job {
    /// With every stock higher by `top_mm` and wider by `side_mm` on each side. A mesh or a saved stock is raised, its sides
    /// stay.
    pub fn with_stock_grown(&self, top_mm: f64, side_mm: f64) -> Self {
        self.with_faces_moved(top_mm, [side_mm; 4])
    }

    /// The same with each side by itself, outward: −x, +x, −y, +y. A cylinder has one side, which moves by their mean.
    pub fn with_faces_moved(&self, top_mm: f64, sides_mm: [f64; 4]) -> Self {
        let grown = |stock: &Stock| match &stock.shape {
            StockShape::Stl(_) | StockShape::Saved(_) => {
                Stock { moved_mm: stock.moved_mm + Vec3::new(0.0, 0.0, top_mm), ..stock.clone() }
            }
            shape => Stock { shape: grown(shape, top_mm, sides_mm), ..stock.clone() },
        };
        Self { stocks: self.stocks.iter().map(grown).collect(), ..self.clone() }
    }

    /// Has any stock sides that [`Self::with_stock_grown`] moves?
    pub fn has_stock_with_sides(&self) -> bool {
        self.stocks.iter().any(|stock| !matches!(stock.shape, StockShape::Stl(_) | StockShape::Saved(_)))
    }

    /// Has any stock four sides that [`Self::with_faces_moved`] moves one by one?
    pub fn has_stock_with_faces(&self) -> bool {
        self.stocks.iter().any(|stock| matches!(stock.shape, StockShape::Box(_)))
    }

    /// With the axis of every end mill off that of the spindle: by so much, this many pitches of its teeth on from tooth 1.
    pub fn with_mills_off_axis(&self, offset_mm: f64, pitches: f64) -> Self {
        let off = |tool: &Tool| {
            let angle_rad = pitches * TAU / f64::from(tool.flutes.max(1));
            let mill = matches!(tool.shape, Shape::Flat | Shape::Ball | Shape::Bull);
            let runout = if mill { Some(Runout { offset_mm, angle_rad }) } else { tool.runout };
            Tool { runout, ..tool.clone() }
        };
        Self { tools: self.tools.iter().map(off).collect(), ..self.clone() }
    }

    /// With every end mill wider by `by_mm` of diameter; `None` when there is none of a shape that is known how to change.
    pub fn with_mills_wider(&self, by_mm: f64) -> Option<Self> {
        let wider: Vec<Option<Tool>> = self.tools.iter().map(|tool| wider(tool, by_mm)).collect();
        let any = wider.iter().any(Option::is_some);
        let tools = wider.into_iter().zip(&self.tools).map(|(new, old)| new.unwrap_or_else(|| old.clone())).collect();
        any.then(|| Self { tools, ..self.clone() })
    }
}

impl Machine {
    /// With a share of the declared acceleration on every axis.
    pub fn with_acceleration(&self, share: f64) -> Self {
        let axis = |axis: &Axis| Axis { acceleration_mm_s2: axis.acceleration_mm_s2 * share, ..*axis };
        Self { axes: [axis(&self.axes[0]), axis(&self.axes[1]), axis(&self.axes[2])], ..self.clone() }
    }
}

fn grown(shape: &StockShape, top_mm: f64, sides_mm: [f64; 4]) -> StockShape {
    let [x_min, x_max, y_min, y_max] = sides_mm;
    match shape {
        StockShape::Box(b) => StockShape::Box(Box3 {
            min: b.min - Vec3::new(x_min, y_min, 0.0),
            max: b.max + Vec3::new(x_max, y_max, top_mm),
        }),
        StockShape::Cylinder { centre, diameter_mm, z_mm } => StockShape::Cylinder {
            centre: *centre,
            diameter_mm: diameter_mm + 0.5 * sides_mm.iter().sum::<f64>(),
            z_mm: [z_mm[0].min(z_mm[1]), z_mm[0].max(z_mm[1]) + top_mm],
        },
        other => other.clone(),
    }
}

fn wider(tool: &Tool, by_mm: f64) -> Option<Tool> {
    let diameter_mm = tool.diameter_mm + by_mm;
    let height = tool.profile.height();
    let profile = match tool.shape {
        Shape::Flat => Profile::flat(diameter_mm, height),
        Shape::Ball => Profile::ball(diameter_mm, height),
        Shape::Bull => Profile::bull(diameter_mm, corner_mm(&tool.profile), height),
        _ => return None,
    };
    (diameter_mm > 0.0).then(|| Tool { profile, diameter_mm, ..tool.clone() })
}

fn corner_mm(profile: &Profile) -> f64 {
    let radius = |s: &Segment| if let Segment::Arc { radius, .. } = s { Some(*radius) } else { None };
    profile.segments.iter().find_map(radius).unwrap_or(0.0)
}
