//! In: a scan folder, filters. Out: another scan folder without what they take away.
//! Frame and unit: the height map's grid frame, mm from its corner.

use crate::cli::terminal::console::Console;
use crate::fault::Result;
use crate::files::not_over_any;
use crate::scan::Filter;
use crate::station::{filter_scan, of_a_scan};
use std::path::PathBuf;

/// Take glints, dust and what does not matter out of a scan
///
/// Filters take cells of the height map and their points away, one after the other, and make nothing up: what stays is as it was
/// measured. The result is a scan folder of its own; its scan.json says what was done and how many cells each filter took.
///
/// sigma:MM takes cells whose standard deviation is larger; heights:LOW,HIGH those outside a range; cut:X0,Y0,X1,Y1 what lies in a box,
/// keep:X0,Y0,X1,Y1 what lies outside one; islands:CELLS,STEP pieces of surface of fewer cells, where neighbours that differ by more
/// than STEP mm are of two pieces. Places are millimetres from the map's corner, heights above its plane.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight filter scans/board7 --filter islands:20,0.5 --filter sigma:0.1 --out scans/clean7")]
pub struct Args {
    /// Folder that sheetlight scan --out wrote
    scan: PathBuf,
    /// A filter, several times, in their order
    #[arg(long = "filter", required = true, value_parser = crate::cli::terminal::arguments::parse::<Filter>, allow_hyphen_values = true)]
    filters: Vec<Filter>,
    /// Folder for the filtered scan
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    not_over_any(&args.out.join("scan.json"), &args.scan, of_a_scan)?;
    let report = filter_scan(&args.scan, &args.filters, &args.out)?;
    let cells = report.filtered.iter().flat_map(|f| f.filters.iter().zip(&f.cells));
    let mut said: String = cells.map(|(f, n)| format!("{n} cells: {f:?}\n")).collect();
    said += &format!("{} points are left\n", report.points);
    console.result(&report, &said);
    console.say(format!("see {}", args.out.display()));
    Ok(())
}
