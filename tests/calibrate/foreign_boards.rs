//! Calibration targets of other programs (Kalibr's AprilGrid, ROS-Industrial's modified circle grid, HALCON's plates)
//! in pictures that this program did not draw: against the projected truth, in pixels, turned, hidden and mirrored.

use sheetlight::calibrate::boards::print::sheet;
use sheetlight::calibrate::boards::{BoardView, FindOptions, find};
use sheetlight::calibrate::camera::procedure::{CameraOptions, calibrate};
use sheetlight::fault::Result;
use sheetlight::geometry::Vec2;
use sheetlight::raster::{Channel, Image, load};
use sheetlight::recording::{BoardSpec, Recording};
use sheetlight::simulate::{Pattern, Set, SimulateOptions, simulate};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const KINDS: [(&str, &str); 4] = [
    ("kalibr", "kalibr.yaml"),
    ("ros_industrial", "ros_industrial.yaml"),
    ("halcon", "halcon.descr"),
    ("halcon_finders", "halcon_finders.cpd"),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/foreign_boards")
}

fn board(kind: &str) -> BoardSpec {
    let (_, file) = KINDS.iter().find(|k| k.0 == kind).unwrap();
    BoardSpec::load(&folder().join(file)).unwrap()
}

/// A picture and the true pixels of its features, by this program's ids.
#[derive(Clone)]
struct Picture {
    width: usize,
    height: usize,
    levels: Vec<u8>,
    truth: BTreeMap<usize, Vec2>,
}

impl Picture {
    fn of(kind: &str, number: usize) -> Picture {
        let image = load(&folder().join(format!("{kind}_{number}.jpg")), Channel::default(), 8).unwrap();
        let all: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder().join("truth.json")).unwrap()).unwrap();
        let points = all[kind][number].as_object().unwrap();
        let pixel = |v: &serde_json::Value| Vec2::from(serde_json::from_value::<[f64; 2]>(v.clone()).unwrap());
        let mut truth = BTreeMap::new();
        for (id, at) in points {
            let id: usize = id.parse().unwrap();
            match kind {
                // 5 x 4 tags from the lower left; corners from the lower left, against the clock.
                "kalibr" => {
                    let place = (3 - id / 5) * 5 + id % 5;
                    truth.extend((0..4).map(|k| (4 * place + k, pixel(&at[3 - k]))));
                }
                // 10 columns in 8 rows, as one reads; our x runs up from the larger dot at the lower left.
                "ros_industrial" => {
                    truth.insert(id % 10 * 8 + 7 - id / 10, pixel(at));
                }
                _ => {
                    truth.insert(id, pixel(at));
                }
            }
        }
        Picture { width: image.width as usize, height: image.height as usize, levels: image.to_u8(), truth }
    }

    fn find(&self, board: &BoardSpec) -> Result<BoardView> {
        let image = Image::from_u8(self.width as u32, self.height as u32, self.levels.clone());
        find(&image, board, &FindOptions::default())
    }

    /// The picture after a quarter turn, clockwise.
    fn turned(&self) -> Picture {
        let (w, h) = (self.width, self.height);
        let levels = (0..w * h).map(|k| self.levels[(h - 1 - k % h) * w + k / h]).collect();
        let truth = self.truth.iter().map(|(id, p)| (*id, Vec2::new((h - 1) as f64 - p.y, p.x))).collect();
        Picture { width: h, height: w, levels, truth }
    }

    fn mirrored(&self) -> Picture {
        let w = self.width;
        let levels = (0..self.levels.len()).map(|k| self.levels[k / w * w + w - 1 - k % w]).collect();
        Picture { levels, ..self.clone() }
    }

    /// The picture with all of a rectangle at one level.
    fn covered(&self, [x0, y0, x1, y1]: [usize; 4], level: u8) -> Picture {
        let mut picture = self.clone();
        for y in y0..y1.min(self.height) {
            picture.levels[y * self.width + x0..y * self.width + x1.min(self.width)].fill(level);
        }
        picture
    }

    /// Distance from the truth: rms per axis, px, and over the stated sigma.
    fn off(&self, view: &BoardView, what: &str) -> [f64; 2] {
        let (mut sum, mut over) = (0.0, 0.0);
        for p in &view.points {
            let off = (p.pixel - self.truth[&p.feature_id]).norm_squared() / 2.0;
            assert!(off.sqrt() < 0.5, "{what}: feature {} is {:.2} px off", p.feature_id, off.sqrt());
            sum += off;
            over += off / p.sigma_px.powi(2);
        }
        let n = view.points.len() as f64;
        let off = [(sum / n).sqrt(), (over / n).sqrt()];
        println!("{what}: {n} of {} features, {:.4} px rms, {:.2} sigma", self.truth.len(), off[0], off[1]);
        off
    }
}

#[test]
fn features_lie_where_the_truth_puts_them_under_all_four_turns() {
    for (kind, _) in KINDS {
        let board = board(kind);
        for number in 0..2 {
            let mut picture = Picture::of(kind, number);
            for turn in 0..4 {
                let what = format!("{kind} {number}, {turn} quarter turns");
                let view = picture.find(&board).unwrap_or_else(|e| panic!("{what}: {e}"));
                assert!(!view.ambiguous, "{what}");
                // Marks with a hole are not measured.
                assert_eq!(view.points.len(), board.features().len() - board.drawn_holes().len(), "{what}");
                let [off, over] = picture.off(&view, &what);
                assert!(off < 0.1, "{what}: {off:.3} px");
                assert!(over < 2.0, "{what}: {over:.2} of the stated sigmas");
                picture = picture.turned();
            }
        }
    }
}

#[test]
fn hidden_parts_leave_the_others_right() {
    for number in 0..2 {
        // A hand over a third of the tags, then the picture's half beyond its rim.
        let picture = Picture::of("kalibr", number);
        for (rectangle, level) in [([180, 0, 300, 200], 90), ([0, 0, 250, 360], 10), ([0, 190, 480, 360], 230)] {
            let view = picture.covered(rectangle, level).find(&board("kalibr")).unwrap();
            let what = format!("kalibr {number}, {rectangle:?} covered");
            assert!(view.points.len() >= 20 && view.points.len() < 80, "{what}: {} corners", view.points.len());
            assert!(picture.off(&view, &what)[0] < 0.1, "{what}");
        }
        let (picture, ros) = (Picture::of("ros_industrial", number), board("ros_industrial"));
        for (rectangle, level) in [([180, 90, 260, 190], 90), ([180, 90, 260, 190], 215), ([0, 0, 480, 126], 10)] {
            let view = picture.covered(rectangle, level).find(&ros).unwrap_or_else(|e| panic!("{rectangle:?}: {e}"));
            let what = format!("ros_industrial {number}, {rectangle:?} covered");
            assert!(view.points.len() >= 40 && view.points.len() < 80, "{what}: {} dots", view.points.len());
            assert!(picture.off(&view, &what)[0] < 0.1, "{what}");
        }
        // Two finder patterns of three are left, then one.
        let (plate, board) = (Picture::of("halcon_finders", number), board("halcon_finders"));
        for rectangle in [[270, 0, 480, 360], [0, 0, 200, 360], [0, 0, 280, 360]] {
            let view = plate.covered(rectangle, 150).find(&board).unwrap_or_else(|e| panic!("{rectangle:?}: {e}"));
            let what = format!("halcon_finders {number}, {rectangle:?} covered");
            assert!(view.points.len() >= 25 && view.points.len() < 129, "{what}: {} marks", view.points.len());
            assert!(plate.off(&view, &what)[0] < 0.1, "{what}");
        }
        // Without its mark the grid has no origin.
        let first = picture.truth[&0];
        let [x, y] = [first.x as usize, first.y as usize];
        let fault = picture.covered([x - 16, y - 16, x + 16, y + 16], 215).find(&ros).unwrap_err();
        assert!(fault.what.contains("with a larger first one"), "{fault}");
    }
}

#[test]
fn a_plate_whose_mark_is_not_seen_is_refused() {
    let (picture, board) = (Picture::of("halcon", 0), board("halcon"));
    let [x, y] = [picture.truth[&0].x as usize, picture.truth[&0].y as usize];
    let fault = picture.covered([x - 34, y - 40, x - 9, y - 10], 210).find(&board).unwrap_err();
    println!("{fault}");
    assert!(fault.what.contains("frame"), "{fault}");
    // A second corner looks filled.
    let [x, y] = [picture.truth[&6].x as usize, picture.truth[&6].y as usize];
    let fault = picture.covered([x + 11, y - 24, x + 50, y - 2], 25).find(&board).unwrap_err();
    println!("{fault}");
    assert!(fault.what.contains("2 corners of the frame"), "{fault}");
    let [x, y] = [picture.truth[&24].x as usize, picture.truth[&24].y as usize];
    let fault = picture.covered([x - 10, y - 10, x + 10, y + 10], 210).find(&board).unwrap_err();
    assert!(fault.what.contains("no grid of 7x7 dots"), "all of its dots have to be in view: {fault}");
}

#[test]
fn mirrored_pictures_are_refused_where_the_target_shows_it() {
    for number in 0..2 {
        let fault = Picture::of("kalibr", number).mirrored().find(&board("kalibr")).unwrap_err();
        assert!(fault.cause.contains("mirrored picture"), "{fault}");
        let fault = Picture::of("ros_industrial", number).mirrored().find(&board("ros_industrial")).unwrap_err();
        assert!(fault.cause.contains("mirrored picture"), "{fault}");
        let fault = Picture::of("halcon_finders", number).mirrored().find(&board("halcon_finders")).unwrap_err();
        assert!(fault.cause.contains("mirrored picture"), "{fault}");
        // Seven rows and seven columns with a mark on the diagonal are their own mirror image (docs/boards.md).
        assert!(Picture::of("halcon", number).mirrored().find(&board("halcon")).is_ok());
    }
}

#[test]
fn another_target_than_described_is_refused() {
    let mut other = board("kalibr");
    if let BoardSpec::MarkerGrid { ring_cells, .. } = &mut other {
        *ring_cells = Some(1);
    }
    let picture = Picture::of("kalibr", 0);
    let fault = picture.find(&other).unwrap_err();
    assert!(fault.what.contains("none of the board's 20 markers"), "{fault}");
    let mut smaller = board("ros_industrial");
    if let BoardSpec::Circles { dots, .. } = &mut smaller {
        *dots = [8, 9];
    }
    let fault = Picture::of("ros_industrial", 0).find(&smaller).unwrap_err();
    assert!(fault.what.contains("at least 8x10 dots"), "{fault}");
    let fault = Picture::of("halcon", 0).find(&board("ros_industrial")).unwrap_err();
    assert!(fault.what.contains("no grid of 8x10 dots with a larger first one"), "{fault}");
}

/// What is printed is what is simulated, and what is simulated is found: the sheet is the target.
#[test]
fn the_printed_sheet_is_the_simulated_board() {
    for (kind, _) in KINDS {
        let board = board(kind);
        let (sheet, pattern) = (sheet(&board).unwrap(), Pattern::new(&board).unwrap());
        let [x0, y0, x1, y1] = board.outline();
        let printed = |x: f64, y: f64| {
            let within = |d: &[f64; 3]| (x - d[0]).hypot(y - d[1]) <= d[2];
            let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0;
            sheet.rectangles.iter().any(|r| x >= r[0] && x <= r[0] + r[2] && y >= r[1] && y <= r[1] + r[3])
                || sheet.triangles.iter().any(|[a, b, c]| side(*a, *b) && side(*b, *c) && side(*c, *a))
                || sheet.discs.iter().any(within) && !sheet.holes.iter().any(within)
        };
        // Steps that fall on no edge of the print.
        let (step, mut black, mut all) = (0.613_7, 0, 0);
        let count = |length: f64| (length / step) as usize;
        for (i, j) in (0..count(x1 - x0)).flat_map(|i| (0..count(y1 - y0)).map(move |j| (i, j))) {
            let [x, y] = [(i as f64 + 0.31) * step, (j as f64 + 0.47) * step];
            let is = pattern.is_black(x + x0, y + y0);
            assert_eq!(is, printed(x, y), "{kind}: {x} {y} mm from the sheet's corner");
            (black, all) = (black + usize::from(is), all + 1);
        }
        println!("{kind}: {black} of {all} places are black");
        assert!(20 * black > all && black < all, "{kind}: {black} of {all}");
    }
}

/// The whole calibration from ten simulated pictures of each target.
#[test]
fn cameras_are_calibrated_with_each_target() {
    for (kind, _) in KINDS {
        let dir = tempfile::tempdir().unwrap();
        let mut board = board(kind);
        if let BoardSpec::Circles { diameter_mm, border_mm, .. } = &mut board {
            // ROS-Industrial's description leaves the dots' size open; what is simulated needs one, and a margin.
            diameter_mm.get_or_insert(10.0);
            *border_mm = 12.0;
        }
        let options =
            SimulateOptions { sets: vec![Set::Intrinsics], board: Some(board), seed: 5, ..SimulateOptions::default() };
        simulate(dir.path(), &options, &|_, _| {}).unwrap();
        let folder = dir.path().join("intrinsics");
        let truth: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.join("truth.json")).unwrap()).unwrap();
        let mut recording = Recording::open(&folder).unwrap();
        recording.meta.frames.truncate(10);
        let result = calibrate(&[recording], &CameraOptions::default(), &|_, _| ()).unwrap();
        let (k, c) = (result.calibration.value, &result.calibration.covariance);
        println!("{kind}: {} of 10 pictures, rms {:.4} px", result.used.len(), result.solved.rms_px);
        assert!(result.used.len() >= 8, "{kind}: {:?}", result.left_out);
        for (name, ours) in [("fx", k.fx), ("fy", k.fy), ("cx", k.cx), ("cy", k.cy)] {
            let (sigma, truth) = (c.sigma(&format!("{name}_px")).unwrap(), truth["intrinsics"][name].as_f64().unwrap());
            println!("{kind} {name}: {ours:.3} +- {sigma:.3}, truth {truth:.3}, {:.2} sigma", (ours - truth) / sigma);
            assert!((ours - truth).abs() < 3.0 * sigma, "{kind} {name}: {ours} +- {sigma}, {truth}");
        }
    }
}
