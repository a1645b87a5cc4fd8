//! The readout of pictures from the sensor as a person states it, if neither camera nor recording states it.

use sheetlight::camera::Readout;

/// What pictures show of the sensor.
#[derive(Clone, clap::Args)]
pub struct ReadoutArgs {
    /// Left upper corner of the sensor region that the pictures show (OffsetX, OffsetY), if neither camera nor
    /// meta.json states it
    #[arg(long, hide_short_help = true, value_name = "X,Y",
        value_parser = crate::cli::terminal::arguments::parse::<Corner>)]
    region: Option<Corner>,
    /// Binning of the pictures in both directions, if neither camera nor meta.json states it
    #[arg(long, hide_short_help = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    binned: Option<u32>,
    /// The pictures show the calibration's view at another resolution, if neither camera nor meta.json states it
    #[arg(long, hide_short_help = true, conflicts_with_all = ["region", "binned"])]
    same_view: bool,
}

/// X,Y in pixels.
#[derive(Clone, Copy)]
struct Corner([u32; 2]);

impl std::str::FromStr for Corner {
    type Err = String;
    fn from_str(s: &str) -> Result<Corner, String> {
        let numbers: Vec<u32> = s.split(',').map_while(|w| w.trim().parse().ok()).collect();
        <[u32; 2]>::try_from(numbers)
            .map(Corner)
            .map_err(|_| format!("'{s}' is not a corner: two whole numbers, 1024,768"))
    }
}

impl ReadoutArgs {
    /// The stated readout; `None` if nothing was stated.
    pub fn stated(&self) -> Option<Readout> {
        if self.same_view {
            return Some(Readout { same_view: true, ..Readout::default() });
        }
        if self.region.is_none() && self.binned.is_none() {
            return None;
        }
        let offset_px = self.region.map_or([0; 2], |c| c.0);
        Some(Readout { offset_px, binning: [self.binned.unwrap_or(1); 2], ..Readout::default() })
    }
}
