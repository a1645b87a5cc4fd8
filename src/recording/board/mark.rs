//! In: the mark of a circle grid, as its description states it. Out: which places of the grid it covers with ink.
//! Frame and unit: board frame, mm; the origin is the first dot.

/// The mark that shows which way round a circle grid lies.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "mark", rename_all = "snake_case", deny_unknown_fields)]
pub enum OriginMark {
    /// The first dot is larger than the others (ROS-Industrial's modified circle grid).
    LargerDot {
        /// Diameter of the first dot, mm; measured in each picture if not stated.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        diameter_mm: Option<f64>,
    },
    /// A frame around the dots, with a filled triangle in the corner beside the first dot (HALCON's plates with
    /// rectangularly arranged marks).
    FrameCorner {
        /// Distance from the centres of the outer dots to the outer edge of the frame, mm.
        frame_mm: f64,
        /// Width of the frame's bars, mm.
        bar_mm: f64,
        /// Legs of the triangle, from the frame's outer corner, mm.
        corner_mm: f64,
    },
    /// Marks in a hexagonal arrangement: each row is shifted by half a pitch against its neighbours, the first one to
    /// the right. Some have a hole (HALCON's plates with finder patterns).
    FinderPatterns {
        /// Column and row of the middle mark of each pattern, counted from 0, in HALCON's order; 1 to 5 of them.
        at: Vec<[u32; 2]>,
    },
}

/// The marks with a hole of HALCON's five finder patterns, seen from the middle mark, in steps along the row and at 60
/// degrees from it to the lower right. They were read off pictures of a plate of 27 x 31 marks that lay wholly in view,
/// beside its description; its rows show which way round it lay.
const PATTERNS: [&[(i32, i32)]; 5] = [
    &[(-1, 0), (-1, 1), (0, -1), (0, 0), (0, 1), (1, -1)],
    &[(-1, 0), (-1, 1), (0, -1), (1, 0)],
    &[(-1, 0), (0, 0), (0, 1), (1, 0)],
    &[(-1, 0), (-1, 1), (0, 0), (1, 0)],
    &[(-1, 0), (-1, 1), (0, -1), (1, -1)],
];

/// Column and row of a hexagonal arrangement as steps along the row and at 60 degrees from it to the lower right.
pub fn hexagonal_node(column: i32, row: i32) -> (i32, i32) {
    (column - (row + row.rem_euclid(2)) / 2, row)
}

impl OriginMark {
    /// Where the frame's ink lies for dots that reach from (0, 0) to `far`: whether a point is on a bar, or on the
    /// triangle. A larger dot has no frame.
    pub fn frame_at(&self, far: [f64; 2], x: f64, y: f64) -> bool {
        let OriginMark::FrameCorner { frame_mm: f, bar_mm, corner_mm } = self else { return false };
        let inside = (x + f).min(far[0] + f - x).min(y + f).min(far[1] + f - y);
        inside >= 0.0 && (inside <= *bar_mm || x + y + 2.0 * f <= *corner_mm)
    }

    /// Middle of the part of the triangle that the frame's bars do not cover, seen from the first dot, mm. It is
    /// white in the three other corners.
    pub fn corner_spot(&self) -> Option<[f64; 2]> {
        let OriginMark::FrameCorner { frame_mm, bar_mm, corner_mm } = self else { return None };
        let at = -frame_mm + bar_mm + (corner_mm - 2.0 * bar_mm) / 3.0;
        Some([at, at])
    }

    /// Columns and rows of the marks with a hole, for the middles of finder patterns.
    pub fn holes(at: &[[u32; 2]]) -> Vec<[i32; 2]> {
        let around = |(middle, pattern): (&[u32; 2], &&[(i32, i32)])| {
            let (a, row) = hexagonal_node(middle[0] as i32, middle[1] as i32);
            pattern.iter().map(|(da, dr)| (a + da, row + dr)).collect::<Vec<_>>()
        };
        let nodes = at.iter().zip(&PATTERNS).flat_map(around);
        nodes.map(|(a, row)| [a + (row + row.rem_euclid(2)) / 2, row]).collect()
    }

    /// Refuses a mark that cannot be told from a grid without it.
    pub(super) fn refusal(&self, pitch_mm: f64, diameter_mm: Option<f64>, dots: [u32; 2]) -> Option<String> {
        match self {
            OriginMark::LargerDot { diameter_mm: None } => None,
            OriginMark::LargerDot { diameter_mm: Some(d) } => {
                let least = LARGER * diameter_mm.unwrap_or(0.0);
                // The circles of two neighbours must not touch.
                let most = 2.0 * pitch_mm - diameter_mm.unwrap_or(0.0);
                (!(*d >= least && *d > 0.0 && *d < most))
                    .then(|| format!("the board's larger dot has {d} mm, {least} to {most} mm is allowed"))
            }
            OriginMark::FinderPatterns { at } => {
                let inside = |p: &[u32; 2]| (0..2).all(|k| p[k] >= 1 && p[k] + 1 < dots[k]);
                let good = (1..=PATTERNS.len()).contains(&at.len()) && at.iter().all(inside);
                (!good).then(|| {
                    format!(
                        "the board's finder patterns are at {at:?} of {}x{} marks; 1 to {} of them, each a mark inside \
                         the rim",
                        dots[0],
                        dots[1],
                        PATTERNS.len()
                    )
                })
            }
            OriginMark::FrameCorner { frame_mm, bar_mm, corner_mm } => {
                let [f, bar, corner] = [*frame_mm, *bar_mm, *corner_mm];
                let good = f > 0.0 && f <= 10_000.0 && bar > 0.0 && bar < f && corner > 2.0 * bar && corner < 2.0 * f;
                (!good).then(|| {
                    format!(
                        "the board's frame_mm is {f}, bar_mm {bar}, corner_mm {corner}; the bar is narrower than \
                         frame_mm, the corner longer than two bars and shorter than 2 frame_mm"
                    )
                })
            }
        }
    }
}

/// Least diameter of the larger dot over that of the others.
pub const LARGER: f64 = 1.2;
