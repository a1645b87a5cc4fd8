//! In: the command line. Out: tolerances of an insertion and distances of approach and retract, for new recipes.
//! Frame and unit: part frame; mm, degrees.

use sheetlight::find::insert::recipe::InsertionSpec;

#[derive(clap::Args)]
pub struct InsertionArgs {
    /// Tolerance of the insertion in the plane, mm
    #[arg(long, value_name = "MM", default_value_t = 0.25)]
    tolerance_mm: f64,
    /// Tolerance of the insertion in rotation, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.5)]
    tolerance_deg: f64,
    /// Height of the approach above the part, mm
    #[arg(long, value_name = "MM", default_value_t = 30.0)]
    approach_mm: f64,
    /// Height of the retract pose above the part, mm
    #[arg(long, value_name = "MM", default_value_t = 60.0)]
    retract_mm: f64,
}

impl InsertionArgs {
    pub fn spec(&self) -> InsertionSpec {
        InsertionSpec::at_the_part((self.tolerance_mm, self.tolerance_deg), self.approach_mm, self.retract_mm)
    }
}
