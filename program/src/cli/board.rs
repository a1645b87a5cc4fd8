//! In: the layout of a calibration board. Out: the board to print, as SVG and PDF at true scale, and its
//! description for meta.json.
//! Frame and unit: mm; board frame as in docs/conventions.md.

use crate::cli::terminal::console::Console;
use sheetlight::calibrate::boards::print::sheet;
use sheetlight::fault::Result;
use sheetlight::recording::{BoardSpec, MarkerLayout, OriginMark};
use std::path::{Path, PathBuf};

/// Draw a calibration board to print at true scale
///
/// Writes NAME.svg, NAME.pdf and NAME.json. The JSON is the board's description: paste it under
/// "board" in a recording's meta.json. Print without scaling, measure the rule under the board, and
/// correct the sizes in the description where the printer was off.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight board charuco 14x10 --square-mm 15 --out boards/charuco
  sheetlight board chessboard 9x6 --square-mm 10 --out boards/chess
  sheetlight board circles 7x5 --square-mm 20 --dot-mm 10 --asymmetric --out boards/dots
  sheetlight board markers 6x4 --square-mm 20 --gap-mm 6 --dictionary DICT_4X4_50 --out tags
  sheetlight board aprilgrid 6x6 --square-mm 30 --gap-mm 9 --out boards/kalibr
  sheetlight board caltab 7x7 --square-mm 12.5 --out boards/halcon
  sheetlight board --like target.yaml --out boards/theirs
Guide: docs/boards.md")]
pub struct Args {
    /// chessboard, charuco, circles, markers (ArUco, AprilTag), aprilgrid (Kalibr) or caltab (HALCON)
    #[arg(value_parser = ["chessboard", "charuco", "circles", "markers", "aprilgrid", "caltab"])]
    #[arg(required_unless_present = "like")]
    kind: Option<String>,
    /// COLUMNSxROWS: inner corners of a chessboard, squares of a ChArUco board, dots, or markers
    #[arg(value_parser = crate::cli::terminal::arguments::parse::<Size>, required_unless_present = "like")]
    size: Option<Size>,
    /// Side of a square or of a marker, or pitch of the dots, mm
    #[arg(long, value_name = "MM", required_unless_present = "like")]
    square_mm: Option<f64>,
    /// Take the board from a description: Kalibr's or ROS-Industrial's .yaml, HALCON's .descr or .cpd, or .json
    #[arg(long, value_name = "FILE", conflicts_with_all = ["kind", "size", "square_mm"])]
    like: Option<PathBuf>,
    /// ChArUco: side of a marker, mm [default: 0.7 of the square]
    #[arg(long, value_name = "MM")]
    marker_mm: Option<f64>,
    /// Markers, aprilgrid: gap between two, mm [default: 0.3 of the marker]
    #[arg(long, value_name = "MM")]
    gap_mm: Option<f64>,
    /// ChArUco, markers, aprilgrid: id of the first one
    #[arg(long, value_name = "ID", default_value_t = 0)]
    first_id: u32,
    /// ChArUco: begin with a white square, as OpenCV before 4.6
    #[arg(long)]
    white_first: bool,
    /// ChArUco, markers: OpenCV's name of the dictionary [default: DICT_5X5_250]
    #[arg(long)]
    dictionary: Option<String>,
    /// Circles: diameter of a dot, mm [default: half of the pitch]
    #[arg(long, value_name = "MM")]
    dot_mm: Option<f64>,
    /// Circles: shift every other row by one pitch; columns are two pitches apart
    #[arg(long)]
    asymmetric: bool,
    /// Circles: diameter of a larger first dot, mm (ROS-Industrial)
    #[arg(long, value_name = "MM")]
    first_dot_mm: Option<f64>,
    /// White margin round the print, mm [default: 0.6 of the square]
    #[arg(long, value_name = "MM")]
    border_mm: Option<f64>,
    /// Path of the files, without extension
    #[arg(long)]
    out: PathBuf,
}

#[derive(Clone, Copy)]
struct Size([u32; 2]);

impl std::str::FromStr for Size {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Size, String> {
        let parsed = s.split_once('x').and_then(|(a, b)| Some(Size([a.parse().ok()?, b.parse().ok()?])));
        parsed.ok_or_else(|| format!("'{s}' is not a size: write COLUMNSxROWS, e.g. 9x6"))
    }
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let board = match &args.like {
        Some(file) => BoardSpec::load(file)?,
        None => asked(args),
    };
    let drawn = sheet(&board)?;
    if let Some(folder) = args.out.parent().filter(|p| !p.as_os_str().is_empty()) {
        sheetlight::files::make_folder(folder)?;
    }
    let with = |extension: &str| {
        let mut path = args.out.clone().into_os_string();
        path.push(extension);
        PathBuf::from(path)
    };
    let text = serde_json::to_string_pretty(&board).expect("plain data");
    let (svg, pdf) = (drawn.svg(), drawn.pdf());
    let sheets: [(&Path, &[u8]); 2] = [(&with(".svg"), svg.as_bytes()), (&with(".pdf"), &pdf)];
    sheetlight::files::write_beside((&with(".json"), text.as_bytes()), &sheets)?;
    if let BoardSpec::Chessboard { inner_corners: [a, b], .. } = board
        && (a + b) % 2 == 0
    {
        console.warn(format!(
            "{a}x{b} inner corners look the same after a half turn; choose one even and one odd number where \
                 poses matter"
        ));
    }
    console.say(format!(
        "{}.svg .pdf .json written: {:.1} x {:.1} mm; print without scaling and check the rule",
        args.out.display(),
        drawn.width,
        drawn.height
    ));
    if console.json {
        console.result(&board, "");
    }
    Ok(())
}

/// The board of the arguments, with defaults for missing ones.
fn asked(args: &Args) -> BoardSpec {
    let (Some(kind), Some(Size(size)), Some(square_mm)) = (args.kind.as_deref(), args.size, args.square_mm) else {
        unreachable!("clap: required without --like")
    };
    let border_mm = args.border_mm.unwrap_or(0.6 * square_mm);
    let dictionary = |default: &str| args.dictionary.clone().unwrap_or_else(|| default.into());
    let first_id = args.first_id;
    let diameter_mm = Some(args.dot_mm.unwrap_or(0.5 * square_mm));
    match kind {
        "chessboard" => {
            BoardSpec::Chessboard { inner_corners: size, square_mm, border_mm, first_square: "black".into() }
        }
        "charuco" => BoardSpec::Charuco {
            squares: size,
            square_mm,
            marker_mm: args.marker_mm.unwrap_or(0.7 * square_mm),
            dictionary: dictionary("DICT_5X5_250"),
            first_id,
            first_square: args.white_first.then(|| "white".into()),
            border_mm,
        },
        "markers" | "aprilgrid" => {
            let kalibr = kind == "aprilgrid";
            BoardSpec::MarkerGrid {
                markers: size,
                marker_mm: square_mm,
                gap_mm: args.gap_mm.unwrap_or(0.3 * square_mm),
                dictionary: dictionary(if kalibr { "DICT_APRILTAG_36h11" } else { "DICT_5X5_250" }),
                first_id,
                border_mm,
                layout: if kalibr { MarkerLayout::Kalibr } else { MarkerLayout::Opencv },
                ring_cells: None,
            }
        }
        // The proportions of gen_caltab's plates.
        "caltab" => BoardSpec::Circles {
            dots: size,
            pitch_mm: square_mm,
            diameter_mm,
            asymmetric: false,
            origin: Some(OriginMark::FrameCorner {
                frame_mm: square_mm,
                bar_mm: square_mm / 4.0,
                corner_mm: square_mm,
            }),
            border_mm: args.border_mm.unwrap_or(0.1 * square_mm),
        },
        _ => BoardSpec::Circles {
            dots: size,
            pitch_mm: square_mm,
            diameter_mm,
            asymmetric: args.asymmetric,
            origin: args.first_dot_mm.map(|d| OriginMark::LargerDot { diameter_mm: Some(d) }),
            border_mm,
        },
    }
}
