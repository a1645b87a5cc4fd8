//! In: a drawing of a part (DXF). Out: a recipe by which find recognizes the part, and a summary of what was read.
//! Frame and unit: part frame, x and y as drawn, z towards the viewer; mm from here on.

use crate::cli::insertion::InsertionArgs;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::Result;
use sheetlight::find::dxf;
use sheetlight::find::dxf::{DxfOptions, Unit};
use sheetlight::find::{TaskOptions, recipe_of};
use std::path::PathBuf;

/// Make a recipe from a DXF drawing, without a scan
///
/// Reads LINE, ARC, CIRCLE, ELLIPSE, SPLINE, LWPOLYLINE, POLYLINE and INSERT of an ASCII DXF. The outermost closed
/// edges are the part's top, those inside are holes, and so on inwards. Edges that close no outline are searched, not
/// measured. Texts, dimensions, hatches and hidden or paper-space entities are skipped and counted, other entities
/// refused. Equal circles in an array become one shape with a grid.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight model socket.dxf --name socket --out socket.toml
  sheetlight model socket.dxf --name socket --unit inch --layer outline --layer pins \\
      --origin 0,0 --out socket.toml
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// ASCII DXF, seen from above
    drawing: PathBuf,
    /// Name of the part
    #[arg(long)]
    name: String,
    /// Unit of the drawing: mm, inch, cm, m, um, mil or foot [default: the one it states]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Unit>)]
    unit: Option<Unit>,
    /// Layer with edges of the part, also if switched off; may be repeated [default: all visible]
    #[arg(long = "layer")]
    layers: Vec<String>,
    /// Insertion datum in the drawing, in its unit [default: middle of the largest outline's box]
    #[arg(long, value_name = "X,Y", value_parser = crate::cli::terminal::arguments::numbers::<2>,
        allow_hyphen_values = true)]
    origin: Option<[f64; 2]>,
    /// Number of turns at which the part looks nearly alike (2: half a turn)
    #[arg(long, value_name = "N", default_value_t = 1)]
    alike_turns: u32,
    /// Cell of the searched map, mm: about two sampling steps of the scan
    #[arg(long, value_name = "MM", default_value_t = 0.5)]
    cell_mm: f64,
    #[command(flatten)]
    insertion: InsertionArgs,
    /// File for the recipe (TOML)
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    outputs::check(&[&args.out], &Inputs { files: &[&args.drawing], ..Inputs::default() })?;
    let bytes = sheetlight::files::read(&args.drawing, dxf::LARGEST)?;
    let options = DxfOptions { unit: args.unit, layers: args.layers.clone(), origin: args.origin };
    let read = dxf::read(&bytes, &options).map_err(|e| e.at(args.drawing.display()))?;
    let [x0, y0, x1, y1] = read.drawing.bounds();
    let recipe = recipe_of(
        read.drawing,
        &TaskOptions {
            name: args.name.clone(),
            cell_mm: args.cell_mm,
            alike_turns: args.alike_turns,
            insertion: args.insertion.spec(),
        },
    )?;
    read.notes.iter().for_each(|n| console.say(n));
    read.warnings.iter().for_each(|w| console.warn(w));
    console.say(format!(
        "{} shapes within {:.3} x {:.3} mm, drawn in {}; part origin at {:.4}, {:.4} of the drawing",
        recipe.shape.len(),
        x1 - x0,
        y1 - y0,
        read.unit,
        read.origin[0],
        read.origin[1]
    ));
    let text = toml::to_string(&recipe).expect("plain data");
    sheetlight::files::write(&args.out, text.as_bytes())?;
    console.result(&recipe, &text);
    console.say(format!("see {}", args.out.display()));
    Ok(())
}
