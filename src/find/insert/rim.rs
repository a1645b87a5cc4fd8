//! In: a scan's points and map, a recipe, poses at which the part may lie. Out: whether the part extends beyond the rim
//! of the scan, past which side, how far, and how the sweep has to move to cover it.
//! Frame and unit: the scan's frame, mm; the scanned area in the map's grid.

use super::hypothesis::lift;
use super::recipe::Recipe;
use super::verdict::judge_inside;
use crate::fault::Fault;
use crate::find::measure::points::Ordered;
use crate::find::measure::pose::measure;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::search::full::Match;
use crate::geometry::{Vec2, Vec3};
use crate::scan::{Along, HeightMap};

/// A part is not recognised if less than this share of its drawn edges was scanned.
const LEAST_SEEN: f64 = 0.3;
/// A part with a smaller share of its edges beyond the rim is measured as if it were complete.
const LEAST_BEYOND: f64 = 0.02;
/// Share of the edges within the scan at which a surface has to end for the pose to be accepted.
const LEAST_ENDED: f64 = 0.5;
/// Number of poses that are measured, the best first.
const PLACES: usize = 8;
/// Width of the surroundings that the sweep has to cover too, in units of the recipe: the part is judged by them.
const MARGIN: f64 = 3.0;
/// Share of the points that may lie past the rim at each end: stray points do not define it.
const STRAY: f64 = 0.001;

/// A part that was scanned only in part.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct CutOff {
    /// Share of the drawn edges that lie beyond the rim, 0 to 1.
    pub beyond: f64,
    /// How far they reach beyond it, mm.
    pub by_mm: f64,
    /// Past which side of the scan, in words.
    pub side: &'static str,
    /// Shift in the scan's frame after which the sweep covers the whole part, mm.
    pub sweep_by_mm: Vec3,
}

impl CutOff {
    /// What was seen, in one sentence.
    pub fn words(&self) -> String {
        format!(
            "the part goes on beyond the rim of the scan: {:.0} % of its edges lie past {}, up to {:.1} mm",
            100.0 * self.beyond,
            self.side,
            self.by_mm
        )
    }

    /// The error for a part that cannot be measured because it is cut off.
    pub fn fault(&self, recipe: &str) -> Fault {
        let [x, y, z]: [f64; 3] = self.sweep_by_mm.into();
        Fault::refused(format!("'{recipe}' was not scanned whole: {}", self.words()))
            .cause("the sweep was too short, or the part lies at the rim of what was swept")
            .next(format!("move the sweep by {x:.1} {y:.1} {z:.1} mm (x y z of the scan's frame), or make it longer"))
    }
}

/// How the part extends beyond the rim, at the match that agrees best with the points inside. `None`: no match reaches
/// beyond the rim and agrees with the points.
pub(super) fn cut_off(points: &Ordered, map: &HeightMap, recipe: &Recipe, matches: &[Match]) -> Option<CutOff> {
    let drawing = recipe.drawing();
    let edges = EdgeIndex::new(&drawing, recipe.measure.unit());
    let samples = edges.samples();
    let area = Area::of(points, map)?;
    let poses = matches.iter().flat_map(|m| std::iter::once(m.pose).chain(m.rivals.iter().map(|r| r.0)));
    let mut best: Option<(f64, CutOff)> = None;
    for pose in poses.take(PLACES) {
        let start = lift(&pose, map, points, recipe);
        let Ok(measured) = measure(points, &drawing, start, &recipe.measure) else { continue };
        let grid_from_part = map.base_from_grid.inverse() * measured.base_from_part;
        let place = |x: f64, y: f64, z: f64| grid_from_part.point(&Vec3::new(x, y, z)).xy();
        let places: Vec<Vec2> = samples.iter().map(|s| place(s.x, s.y, s.z)).collect();
        let beyond = places.iter().filter(|p| area.outside(p).0 > map.cell).count() as f64 / places.len() as f64;
        if !(LEAST_BEYOND..=1.0 - LEAST_SEEN).contains(&beyond) {
            continue;
        }
        let inside = |x: f64, y: f64| area.outside(&place(x, y, samples[0].z)).0 < -map.cell;
        let seen = judge_inside(points, &drawing, &measured, &recipe.measure, &inside);
        let good = seen.agreement >= recipe.gates.min_agreement && seen.edges >= LEAST_ENDED;
        let value = seen.agreement * seen.edges;
        if !good || best.as_ref().is_some_and(|b| b.0 >= value) {
            continue;
        }
        let farthest = places.iter().map(|p| area.outside(p)).max_by(|a, b| a.0.total_cmp(&b.0));
        let (by_mm, side) = farthest.expect("a drawing has edges");
        let by = area.move_to_hold(&places, MARGIN * recipe.measure.unit());
        let sweep_by_mm = map.base_from_grid.direction(&Vec3::new(by.x, by.y, 0.0));
        best = Some((value, CutOff { beyond, by_mm, side, sweep_by_mm }));
    }
    best.map(|b| b.1)
}

/// One of the two directions in which a scan grows: from shot to shot, or along the stripe.
struct Way {
    /// Unit vector towards larger numbers, across the lines of equal number.
    towards: Vec2,
    /// The smallest and the largest value of `towards · place`, mm.
    ends: [f64; 2],
    /// Names of the sides past these ends.
    sides: [&'static str; 2],
}

/// The scanned area: the parallelogram between the first and the last shot and between the stripe's ends.
struct Area([Way; 2]);

impl Area {
    /// `None`: fewer than two shots, or points on one line.
    fn of(points: &Ordered, map: &HeightMap) -> Option<Area> {
        let grid_from_base = map.base_from_grid.inverse();
        let places: Vec<Vec2> = points.points.iter().map(|p| grid_from_base.point(p).xy()).collect();
        let number = |all: &[u32]| all.iter().map(|n| f64::from(*n)).collect::<Vec<_>>();
        let picture = match points.along {
            Along::U => ["the picture's left edge", "the picture's right edge"],
            Along::V => ["the picture's upper edge", "the picture's lower edge"],
        };
        Some(Area([
            Way::of(&places, &number(&points.row), ["the first shot", "the last shot"])?,
            Way::of(&places, &number(&points.column), picture)?,
        ]))
    }

    /// How far a place lies outside, mm (negative inside), and past which side.
    fn outside(&self, p: &Vec2) -> (f64, &'static str) {
        let ends = self.0.iter().flat_map(|way| {
            let at = way.towards.dot(p);
            [(way.ends[0] - at, way.sides[0]), (at - way.ends[1], way.sides[1])]
        });
        ends.max_by(|a, b| a.0.total_cmp(&b.0)).expect("four sides")
    }

    /// The shortest move after which the area covers the places with a margin. An area that is too small is centred on
    /// them.
    fn move_to_hold(&self, places: &[Vec2], margin: f64) -> Vec2 {
        let by = [0, 1].map(|k| {
            let way = &self.0[k];
            let at = places.iter().map(|p| way.towards.dot(p));
            let (low, high) = at.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)));
            let (before, past) = (low - margin - way.ends[0], high + margin - way.ends[1]);
            if before < past { (before + past) / 2.0 } else { before.min(0.0) + past.max(0.0) }
        });
        let across = nalgebra::Matrix2::from_rows(&self.0.each_ref().map(|way| way.towards.transpose()));
        across.try_inverse().map_or(Vec2::zeros(), |inverse| inverse * Vec2::from(by))
    }
}

impl Way {
    /// Fits the shot or column number of each place over the plane by least squares; its gradient gives the direction.
    fn of(places: &[Vec2], numbers: &[f64], sides: [&'static str; 2]) -> Option<Way> {
        let n = places.len() as f64;
        let (middle, mean) = (places.iter().sum::<Vec2>() / n, numbers.iter().sum::<f64>() / n);
        let (mut spread, mut grows) = (nalgebra::Matrix2::zeros(), Vec2::zeros());
        for (p, number) in places.iter().zip(numbers) {
            let d = p - middle;
            spread += d * d.transpose();
            grows += d * (number - mean);
        }
        let towards = (spread.try_inverse()? * grows).try_normalize(1e-12)?;
        let mut at: Vec<f64> = places.iter().map(|p| towards.dot(p)).collect();
        at.sort_by(f64::total_cmp);
        // A few stray points do not define the rim.
        let end = |share: f64| at[(share * (at.len() - 1) as f64).round() as usize];
        Some(Way { towards, ends: [end(STRAY), end(1.0 - STRAY)], sides })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{CloudPoint, GridOptions, Shots, grid};

    /// An area scanned from x = 0 to 20 and y = 0 to 10.
    fn area() -> Area {
        let way = |towards: Vec2, end: f64, sides: [&'static str; 2]| Way { towards, ends: [0.0, end], sides };
        Area([way(Vec2::x(), 20.0, ["first", "last"]), way(Vec2::y(), 10.0, ["left", "right"])])
    }

    #[test]
    fn an_area_knows_what_lies_outside_and_past_which_side() {
        assert_eq!(area().outside(&Vec2::new(10.0, 4.0)).0, -4.0);
        assert_eq!(area().outside(&Vec2::new(23.0, 5.0)), (3.0, "last"));
        assert_eq!(area().outside(&Vec2::new(1.0, -2.0)), (2.0, "left"));
    }

    #[test]
    fn an_area_moves_as_little_as_holds_the_part_and_to_its_middle_where_it_is_too_small() {
        let part = [Vec2::new(15.0, 5.0), Vec2::new(24.0, 5.0), Vec2::new(24.0, 9.5)];
        assert_eq!(area().move_to_hold(&part, 1.0), Vec2::new(5.0, 0.5));
        assert_eq!(area().move_to_hold(&[Vec2::new(10.0, 5.0)], 1.0), Vec2::zeros());
        assert_eq!(area().move_to_hold(&[Vec2::new(0.0, 5.0), Vec2::new(30.0, 5.0)], 0.0), Vec2::new(5.0, 0.0));
    }

    /// Stripes along u and along v: shots and the picture's sides are named as the camera saw them.
    #[test]
    fn sides_are_named_by_the_stripes_axis_of_the_picture() {
        for (along, before, past) in [
            (Along::U, "the picture's left edge", "the picture's right edge"),
            (Along::V, "the picture's upper edge", "the picture's lower edge"),
        ] {
            let mut cloud = Vec::new();
            for shot in 0..40u32 {
                for column in 0..60u32 {
                    let position = glam::Vec3::new(0.2 * shot as f32, 0.2 * column as f32, 0.0);
                    let (u, v) = if along == Along::U { (column as f32, 9.0) } else { (9.0, column as f32) };
                    cloud.push(CloudPoint { position, sigma_mm: 0.02, intensity: 9.0, quality: 1.0, shot, u, v });
                }
            }
            let points = Ordered::new(&cloud, &Shots::unplaced(along)).unwrap();
            let map = grid(&cloud, &GridOptions { cell: Some(0.2), ..GridOptions::default() }).unwrap();
            let area = Area::of(&points, &map).unwrap();
            let side = |x: f64, y: f64| {
                let p = map.base_from_grid.inverse().point(&Vec3::new(x, y, 0.0));
                area.outside(&p.xy()).1
            };
            assert_eq!((side(4.0, -3.0), side(4.0, 15.0)), (before, past));
            assert_eq!((side(-3.0, 6.0), side(11.0, 6.0)), ("the first shot", "the last shot"));
        }
    }

    #[test]
    fn ways_are_found_from_numbered_points_of_a_slanted_sweep() {
        let (mut places, mut shots, mut columns) = (vec![], vec![], vec![]);
        for shot in 0..50u32 {
            for column in 0..80u32 {
                // Stripes along (1, 1), shots along x.
                let along = f64::from(column) * 0.1;
                places.push(Vec2::new(f64::from(shot) * 0.3 + along, along));
                shots.push(f64::from(shot));
                columns.push(f64::from(column));
            }
        }
        let way = Way::of(&places, &shots, ["first", "last"]).unwrap();
        assert!((way.towards - Vec2::new(1.0, -1.0).normalize()).norm() < 1e-9, "{:?}", way.towards);
        let way = Way::of(&places, &columns, ["left", "right"]).unwrap();
        assert!((way.towards - Vec2::y()).norm() < 1e-9 && (way.ends[1] - 7.9).abs() < 0.11, "{:?}", way.ends);
    }
}
