//! In: what a recipe may choose about measuring. Out: the choice, checked.
//! Frame and unit: part frame, mm.

use crate::fault::{Fault, Result};

/// How the pose is measured.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureOptions {
    /// A point nearer than this to a face's height lies on that face, mm, 0.0001 to 100.
    pub height_gate_mm: f64,
    /// Largest distance from a drawn edge at which an end of a surface is assigned to it, mm, 0.0001 to 100.
    pub edge_gate_mm: f64,
    /// Points nearer than this to an edge are excluded from the fit of height and tilt, mm, 0.0001 to 100.
    pub margin_mm: f64,
    /// Standard deviation of the error that a piece of an edge shares, as a share of the sampling step, 0 to 0.5. It
    /// covers what the model of partly lit samples does not explain: a wall that shows, a chamfer, the pixels' raster.
    pub edge_bias: f64,
    /// Standard deviation of a part's sizes relative to the drawing, common to all of them, as a share, 0 to 0.1. One
    /// direction differs from the other by a third of it.
    pub size_sigma: f64,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        MeasureOptions { height_gate_mm: 0.2, edge_gate_mm: 0.45, margin_mm: 0.5, edge_bias: 0.07, size_sigma: 0.0015 }
    }
}

impl MeasureOptions {
    /// Scale of the lengths that no option states. They are proportional to the margin, the reach of an edge's blur,
    /// and were tried at 0.5 mm: 1 at that margin, 2 where everything is twice as large.
    pub(in crate::find) fn unit(&self) -> f64 {
        self.margin_mm / 0.5
    }

    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<()> {
        let range = |name: &str, v: f64, a: f64, b: f64| {
            if (a..=b).contains(&v) {
                Ok(())
            } else {
                Err(Fault::usage(format!("{name} is {v}; allowed: {a} to {b}")).next("correct [measure] in the recipe"))
            }
        };
        range("height_gate_mm", self.height_gate_mm, 1e-4, 100.0)?;
        range("edge_gate_mm", self.edge_gate_mm, 1e-4, 100.0)?;
        range("margin_mm", self.margin_mm, 1e-4, 100.0)?;
        range("edge_bias", self.edge_bias, 0.0, 0.5)?;
        range("size_sigma", self.size_sigma, 0.0, 0.1)
    }
}
