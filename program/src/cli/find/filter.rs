//! In: a scan folder, filters. Out: another scan folder without the points and cells that the filters remove.
//! Frame and unit: the height map's grid frame, mm from its corner.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::Typed;
use crate::procedure::FilterOrder;
use sheetlight::fault::Result;
use std::path::PathBuf;

/// Remove glints, dust and unwanted regions from a scan
///
/// Filters remove cells of the height map and their points, one after the other. They change and add nothing. The
/// result is a scan folder of its own; its scan.json lists the filters and how many cells each removed.
///
/// Filter sigma:MM removes cells with a larger standard deviation. Filter heights:LOW,HIGH removes those outside a
/// range. Filter cut:X0,Y0,X1,Y1 removes a box, keep:X0,Y0,X1,Y1 everything outside a box. Filter islands:CELLS,STEP
/// removes pieces of surface with fewer cells; neighbours that differ by more than STEP mm belong to two pieces.
/// Positions are millimetres from the map's corner, heights above its plane.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight filter scans/board7 --filter islands:20,0.5 --filter sigma:0.1 --out scans/clean7
Guide: docs/scanning.md")]
pub struct Args {
    #[command(flatten)]
    order: FilterOrder,
    /// Folder for the filtered scan
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let report = args.order.filter(&Typed, &args.out)?;
    let cells = report.filtered.iter().flat_map(|f| f.filters.iter().zip(&f.cells));
    let mut said: String = cells.map(|(f, n)| format!("{n} cells: {f:?}\n")).collect();
    said += &format!("{} points are left\n", report.points);
    console.result(&report, &said);
    console.say(format!("see {}", args.out.display()));
    Ok(())
}
