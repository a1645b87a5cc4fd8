//! In: the points of a scan near a part. Out: the part's height and tilt from the points on its faces
//! (docs/math.md, Insertion (1)).
//! Frame and unit: a correction in the part frame: z mm, turns about x and y rad.

use super::options::MeasureOptions;
use super::points::{Ordered, localise};
use super::robust::robust;
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::{Base, Part, Rigid, Vec3};
use nalgebra::{Matrix3, Vector3};

/// Fewer points do not give a datum.
const MIN_SURFACE: usize = 60;
/// One point in this many, those farthest from an edge, is always used, however far the light reaches.
const INNERMOST: usize = 3;
/// Largest distance that light reaches along a surface, in units of the recipe.
const FARTHEST: f64 = 6.0;

pub(in crate::find) struct Datum {
    pub step: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    pub used: usize,
    pub sigma: f64,
}

/// Lays a level start onto the part's faces. At a degree of tilt, a long part rises from end to end by more than any
/// gate, so the points at its ends are recognised only in later rounds. Stops where too few points lie on the faces.
pub(in crate::find) fn laid(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Rigid<Base, Part> {
    // The gate grows along the part with each round's tilt.
    const ROUNDS: usize = 4;
    let (faces, edges) = (drawing.faces(), EdgeIndex::new(drawing, options.unit()));
    let mut pose = start;
    for _ in 0..ROUNDS {
        let Ok(d) = fit_datum(points, &localise(points, drawing, &pose, options), &faces, &edges, options, 0) else {
            break;
        };
        pose = pose * moved(&d.step);
    }
    pose
}

/// A datum's correction as a motion.
pub(in crate::find) fn moved(step: &Vector3<f64>) -> Rigid<Part, Part> {
    Rigid::from_vectors(&Vec3::new(step.y, step.z, 0.0), Vec3::new(0.0, 0.0, step.x))
}

/// Height and tilt from the points inside the faces.
pub(in crate::find) fn fit_datum(
    points: &Ordered,
    local: &[Option<Vec3>],
    faces: &[Face],
    edges: &EdgeIndex,
    options: &MeasureOptions,
    round: usize,
) -> Result<Datum> {
    let gate = if round == 0 { 4.0 * options.height_gate_mm } else { 2.0 * options.height_gate_mm };
    // If a point is nearer to an edge than its light reaches, some of that light comes from beside the face. Its centre
    // is then off, up at one end of the stripe and down at the other.
    let reach = points.reach_mm.min(FARTHEST * options.unit()).max(options.margin_mm);
    let mut inside: Vec<(Vector3<f64>, f64, u32)> = Vec::new();
    let mut from_edge = Vec::new();
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        let Some(face) = faces.iter().filter(|f| (q.z - f.z).abs() < gate).find(|f| f.material(q.x, q.y)) else {
            continue;
        };
        let edge = edges.nearest(q.x, q.y, reach, |s| s.z == face.z);
        let d = edge.map_or(f64::MAX, |s| (s.x - q.x).hypot(s.y - q.y));
        if d > options.margin_mm {
            inside.push((Vector3::new(1.0, q.y, -q.x), q.z - face.z, points.row[i]));
            from_edge.push(d);
        }
    }
    let mut farthest = from_edge.clone();
    farthest.sort_unstable_by(|a, b| b.total_cmp(a));
    // On narrow faces, the points farthest inside are used.
    let kept = (farthest.len() / INNERMOST).max(MIN_SURFACE);
    let margin = farthest.get(kept).map_or(0.0, |d| d.min(reach));
    let rows: Vec<_> = inside.into_iter().zip(from_edge).filter(|(_, d)| *d >= margin).map(|(row, _)| row).collect();
    if rows.len() < MIN_SURFACE {
        return Err(Fault::refused(format!(
            "{} points lie on the part's level surfaces (to {} mm, from height_gate_mm), at least {MIN_SURFACE} are \
             needed",
            rows.len(),
            gate
        ))
        .cause("the part is hidden, is another one, or the search was misled")
        .next("look at the picture of the match, then scan the part again"));
    }
    robust(&rows, &[], 0.005 * options.unit())
        .map(|f| Datum { step: f.step, covariance: f.covariance, used: f.used, sigma: f.sigma })
        .ok_or_else(|| {
            Fault::refused("the seen surfaces do not determine height and tilt")
                .cause("they lie on one line")
                .next("scan more of the part")
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Along, CloudPoint, Shots};
    use rand::{Rng, SeedableRng};

    /// A level plate of 24 x 16 mm in steps of 0.2 mm, with a stripe slanted by `lean`. The light reaches 1.5 mm: that
    /// near to the plate's two ends along the stripe, up to half of a profile comes from what lies beside it. The
    /// centre is off by up to 0.1 mm, up at one end, down at the other.
    fn plate(lean: f32, stripe_px: Option<f32>) -> Ordered {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let mut cloud = Vec::new();
        for shot in 0..80u32 {
            for column in 0..120u32 {
                let (x, y) = (0.2 * f64::from(column) - 11.9, 0.2 * f64::from(shot) - 7.9);
                let cut = (1.0 - (12.0 - x.abs()) / 1.5).max(0.0);
                let z = 0.1 * cut * x.signum() + rng.random_range(-0.05..0.05);
                let position = glam::Vec3::new(x as f32, y as f32, z as f32);
                let (u, v) = (column as f32, 200.0 + lean * column as f32);
                cloud.push(CloudPoint { position, sigma_mm: 0.02, intensity: 100.0, quality: 1.0, shot, u, v });
            }
        }
        Ordered::new(&cloud, &Shots::unplaced(Along::U).with_stripe(stripe_px)).unwrap()
    }

    #[test]
    fn what_a_slanted_stripe_reads_beyond_an_edge_does_not_tilt_a_part() {
        let drawing = Drawing::parse("[[shape]]\nkind = \"rectangle\"\ncentre = [0, 0]\nsize = [24, 16]\n").unwrap();
        let options = MeasureOptions::default();
        let (faces, edges) = (drawing.faces(), EdgeIndex::new(&drawing, options.unit()));
        let tilt = |points: &Ordered| {
            let local = localise(points, &drawing, &Rigid::identity(), &options);
            fit_datum(points, &local, &faces, &edges, &options, 3).unwrap().step.z.abs()
        };
        // Two stripe widths of 2.8 px, half as much again for the slant, in pixels of 0.2 mm over the length of a
        // slanted step.
        let known = plate(0.5, Some(2.8));
        assert!((known.reach_mm - 2.0 * 1.5 * 2.8 * 0.2 / 1.25f64.sqrt()).abs() < 0.02, "{}", known.reach_mm);
        let [with, without] = [tilt(&known), tilt(&plate(0.5, None))];
        assert!(with < 2e-4 && without > 6e-4, "tilt {with} rad, {without} where the stripe's width is unknown");
    }
}
