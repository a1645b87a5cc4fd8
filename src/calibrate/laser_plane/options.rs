//! In: a user's settings for the laser plane. Out: the checked settings, and the refusal that all checks share.
//! Frame and unit: px, mm; stated per field.

use crate::fault::{Fault, Result};

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct LaserPlaneOptions {
    /// Peaks closer than this to an edge of the print or the board are not used, in stripe widths; 0..=20.
    pub edge_widths: f64,
    /// Peaks farther than this from the stripe of the consensus plane are never used, px; 0.5..=50.
    pub gate_px: f64,
    /// Peaks with a larger residual than this are excluded, in sigmas; 2.5..=10.
    pub gate_sigmas: f64,
    /// A picture is excluded if its stripe lies farther than this from the position that the others predict: squared,
    /// in sigmas of both, two degrees of freedom; 9..=1000.
    pub gate_surprise: f64,
    /// Smallest share of the length of a picture's stripe that must agree for the picture to count; 0.1..=0.95.
    pub min_share: f64,
    /// Smallest number of peaks per picture; 2..=10000.
    pub min_peaks: usize,
    /// Random seed of the consensus.
    pub seed: u64,
}

impl Default for LaserPlaneOptions {
    fn default() -> Self {
        LaserPlaneOptions {
            edge_widths: 2.5,
            gate_px: 2.0,
            gate_sigmas: 4.0,
            gate_surprise: 25.0,
            min_share: 0.6,
            min_peaks: 10,
            seed: 1,
        }
    }
}

impl LaserPlaneOptions {
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("edge_widths", self.edge_widths, 0.0, 20.0),
            ("gate_px", self.gate_px, 0.5, 50.0),
            ("gate_sigmas", self.gate_sigmas, 2.5, 10.0),
            ("gate_surprise", self.gate_surprise, 9.0, 1000.0),
            ("min_share", self.min_share, 0.1, 0.95),
            ("min_peaks", self.min_peaks as f64, 2.0, 10000.0),
        ];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}

pub(in crate::calibrate) fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("the boards were too few, too alike, or hardly lit by the laser")
        .next("show the board at five or more distances and tilts, the stripe right across it")
}
