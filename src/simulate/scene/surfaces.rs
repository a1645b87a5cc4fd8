//! In: a scene file's content, or a board. Out: the surfaces and materials that rays hit, and the distance of a
//! measured point from the nearest surface.
//! Frame and unit: scene frame, z up, mm.

use super::spec::{FARTHEST, Material, PartSpec, SceneSpec, SolidSpec};
use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Part, Rigid, Vec3};
use crate::recording::BoardSpec;
use crate::simulate::pattern::Pattern;
use crate::simulate::solid::{Body, Cut, Shape};

/// Most copies of one solid, and most cuts in it.
const MOST_COPIES: u64 = 10_000;
const MOST_BODIES: u64 = 100_000;

/// Positions of the copies, centred on the origin.
fn copies(repeat: [u32; 2], pitch: [f64; 2]) -> impl Iterator<Item = Vec3> {
    let offset = move |i: u32, axis: usize| (f64::from(i) - f64::from(repeat[axis] - 1) / 2.0) * pitch[axis];
    (0..repeat[1]).flat_map(move |j| (0..repeat[0]).map(move |i| Vec3::new(offset(i, 0), offset(j, 1), 0.0)))
}

/// A body at its pose, with a bounding ball that most rays miss.
#[derive(Clone, Debug)]
struct Placed {
    body: Body,
    /// Scene from body.
    rotation: Mat3,
    at: Vec3,
    centre: Vec3,
    radius: f64,
    material: Material,
    /// A printed pattern on the top face; in the board frame x is right, y down, z into the board.
    print: Option<Print>,
    /// Index of the part that the body belongs to, if any.
    part: Option<usize>,
}

#[derive(Clone, Debug)]
struct Print {
    pattern: Pattern,
    /// Board coordinates of the middle of the top face.
    middle: [f64; 2],
    black: f64,
}

/// The surface point that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray, mm.
    pub t: f64,
    /// Position in the scene frame, mm.
    pub point: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Material of the surface there, including its print.
    pub material: Material,
}

/// A scene ready for rays.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The content that it was made from.
    pub spec: SceneSpec,
    bodies: Vec<Placed>,
}

impl Scene {
    /// Refuses invalid sizes and materials, too many solids, and an empty scene.
    pub fn new(spec: SceneSpec) -> Result<Scene> {
        let mut bodies = Vec::new();
        let world = (Mat3::identity(), Vec3::zeros());
        for solid in &spec.solid {
            place(&mut bodies, solid, &world, None)?;
        }
        for (i, part) in spec.part.iter().enumerate() {
            for solid in &part.solid {
                place(&mut bodies, solid, &part.scene_from_part(), Some(i)).map_err(|e| e.at(&part.name))?;
            }
        }
        if bodies.is_empty() {
            return Err(Fault::input(format!("the scene '{}' holds nothing", spec.name)).next("add a [[solid]]"));
        }
        Ok(Scene { spec, bodies })
    }

    /// A calibration board alone. The board's frame is turned so that the scene's z points out of the board: scene x
    /// = board x, scene y = -board y, scene z = -board z.
    ///
    /// # Errors
    /// A ChArUco board that needs markers which its dictionary does not contain.
    pub fn of_board(board: &BoardSpec, white: f64, black: f64) -> Result<Scene> {
        let [x0, y0, x1, y1] = board.outline();
        let spec = SceneSpec {
            name: "board".into(),
            region_mm: [x0, -y1, x1, -y0],
            focus_height_mm: 0.0,
            solid: vec![],
            part: vec![],
        };
        let middle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0];
        let half = [(x1 - x0) / 2.0, (y1 - y0) / 2.0];
        let at = Vec3::new(middle[0], -middle[1], 0.0);
        let placed = Placed {
            body: Body { shape: Shape::Block { half, depth: 3.0, drop: 0.0 }, cuts: vec![] },
            rotation: Mat3::identity(),
            at,
            centre: at,
            radius: half[0].hypot(half[1]) + 3.0,
            material: Material { albedo: white, ..Material::default() },
            print: Some(Print { pattern: Pattern::new(board)?, middle, black }),
            part: None,
        };
        Ok(Scene { spec, bodies: vec![placed] })
    }

    /// First surface along `o + t d`, t in 0..far; `d` of unit length.
    pub fn hit(&self, o: &Vec3, d: &Vec3, far: f64) -> Option<Hit> {
        let mut best: Option<(f64, Vec3, usize)> = None;
        for (i, b) in self.bodies.iter().enumerate() {
            let limit = best.map_or(far, |(t, ..)| t);
            if let Some((t, n)) = b.hit(o, d).filter(|(t, _)| *t < limit) {
                best = Some((t, n, i));
            }
        }
        best.map(|(t, normal, i)| {
            let (b, point) = (&self.bodies[i], o + d * t);
            Hit { t, point, normal: b.rotation * normal, material: b.material_at(&point) }
        })
    }

    /// Whether nothing stands between two points; the surfaces that the points lie on do not count.
    pub fn clear(&self, from: &Vec3, to: &Vec3) -> bool {
        let way = to - from;
        let length = way.norm();
        let d = way / length;
        !self.bodies.iter().any(|b| b.hit(from, &d).is_some_and(|(t, _)| t < length - 1e-4))
    }

    /// Unsigned distance of a scene-frame point from the nearest surface, mm (see `Body::distance`).
    /// Surfaces that lie inside another body do not count.
    pub fn distance(&self, p: &Vec3) -> f64 {
        self.bodies.iter().map(|b| b.body.distance(&b.to_body(p))).fold(f64::INFINITY, f64::min).abs()
    }

    /// Distance of a scene-frame point from the nearest surface, mm; negative inside a solid.
    pub fn clearance(&self, p: &Vec3) -> f64 {
        self.bodies.iter().map(|b| b.body.distance(&b.to_body(p))).fold(f64::INFINITY, f64::min)
    }

    /// The same scene with a calibration board added: `rotation` and `at` transform the board's coordinates to the
    /// scene's.
    ///
    /// # Errors
    /// As [`Scene::of_board`].
    pub fn with_board(
        mut self,
        board: &BoardSpec,
        rotation: &Mat3,
        at: &Vec3,
        white: f64,
        black: f64,
    ) -> Result<Scene> {
        // In the board's own scene z points out of the board.
        let out_of_board = Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
        for mut placed in Scene::of_board(board, white, black)?.bodies {
            placed.rotation = rotation * out_of_board * placed.rotation;
            for place in [&mut placed.at, &mut placed.centre] {
                *place = rotation * (out_of_board * *place) + at;
            }
            self.bodies.push(placed);
        }
        Ok(self)
    }

    /// The part that is nearest to a scene-frame point; `None` if something else is nearer.
    pub fn part_near(&self, p: &Vec3) -> Option<usize> {
        let key = |b: &&Placed| b.body.distance(&b.to_body(p)).abs();
        self.bodies.iter().min_by(|a, b| key(a).total_cmp(&key(b))).and_then(|b| b.part)
    }
}

fn place(out: &mut Vec<Placed>, solid: &SolidSpec, frame: &(Mat3, Vec3), part: Option<usize>) -> Result<()> {
    let m = solid.material;
    let ranges = [(m.albedo, 1.0), (m.mirror, 1.0), (m.gloss, 20.0), (m.gloss_exponent, 500.0)];
    if let Some((value, most)) = ranges.iter().find(|(v, most)| !(0.0..=*most).contains(v)) {
        return Err(Fault::input(format!("a material holds {value}, allowed 0..={most}")).next("correct the material"));
    }
    let of = |r: [u32; 2]| u64::from(r[0]) * u64::from(r[1]);
    let cuts = solid.cut.iter().map(|c| of(c.repeat)).fold(0, u64::saturating_add);
    for (what, n, least) in [("copies", of(solid.repeat), 1), ("cuts", cuts, solid.cut.len() as u64)] {
        if !(least..=MOST_COPIES).contains(&n) || solid.cut.iter().any(|c| of(c.repeat) == 0) {
            return Err(Fault::input(format!("a solid has {n} {what}, limit 1 to {MOST_COPIES}"))
                .cause("a slip in repeat")
                .next("correct repeat; leave it out for a single one"));
        }
    }
    // Bodies that are there already count too, because every ray is tested against all bodies.
    let held =
        out.iter().map(|b| 1 + b.body.cuts.len() as u64).sum::<u64>() + of(solid.repeat).saturating_mul(1 + cuts);
    if held > MOST_BODIES {
        return Err(Fault::input(format!("the scene holds {held} solids and cuts, limit {MOST_BODIES}"))
            .cause("a slip in repeat")
            .next("draw less of the scene"));
    }
    let places = solid.cut.iter().flat_map(|c| c.at_mm.into_iter().chain(c.pitch_mm).chain([c.turn_deg]));
    let mut places = places.chain(solid.at_mm).chain(solid.pitch_mm).chain([solid.turn_deg]);
    if let Some(bad) = places.find(|v| !(v.abs() <= FARTHEST)) {
        return Err(Fault::input(format!("a place, pitch or turn is {bad}, allowed -{FARTHEST}..={FARTHEST}"))
            .cause("a slip in the scene file")
            .next("correct the solid"));
    }
    let shape = solid.shape.build()?;
    let mut cuts = Vec::new();
    for cut in &solid.cut {
        let shape = cut.shape.build()?;
        let at = |c: Vec3| Cut::new(shape, c + Vec3::from(cut.at_mm), cut.turn_deg);
        cuts.extend(copies(cut.repeat, cut.pitch_mm).map(at));
    }
    let turn = crate::geometry::exp(&(Vec3::z() * solid.turn_deg.to_radians()));
    let (half, depth) = shape.bounds();
    for copy in copies(solid.repeat, solid.pitch_mm) {
        let rotation = frame.0 * turn;
        let at = frame.0 * (Vec3::from(solid.at_mm) + copy) + frame.1;
        out.push(Placed {
            body: Body { shape, cuts: cuts.clone() },
            rotation,
            at,
            centre: at - rotation * Vec3::new(0.0, 0.0, depth / 2.0),
            radius: Vec3::new(half[0], half[1], depth / 2.0).norm() + 1e-3,
            material: m,
            print: None,
            part,
        });
    }
    Ok(())
}

impl Placed {
    fn to_body(&self, p: &Vec3) -> Vec3 {
        self.rotation.tr_mul(&(p - self.at))
    }
    fn hit(&self, o: &Vec3, d: &Vec3) -> Option<(f64, Vec3)> {
        let m = o - self.centre;
        let along = m.dot(d);
        if m.norm_squared() - along * along > self.radius * self.radius || along > self.radius {
            return None;
        }
        self.body.hit(&self.to_body(o), &self.rotation.tr_mul(d))
    }
    fn material_at(&self, p: &Vec3) -> Material {
        let Some(print) = &self.print else { return self.material };
        let q = self.to_body(p);
        let black = q.z > -1e-3 && print.pattern.is_black(q.x + print.middle[0], -q.y + print.middle[1]);
        Material { albedo: if black { print.black } else { self.material.albedo }, ..self.material }
    }
}

/// A part's pose with the scene as base frame; multiplied by base_from_scene it is the true pose.
pub fn part_pose<S: crate::geometry::Frame>(part: &PartSpec) -> Rigid<S, Part> {
    let (r, t) = part.scene_from_part();
    Rigid::new(r, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
        name = "test"
        region_mm = [-20, -20, 20, 20]
        [[solid]]
        shape = { block = { size_mm = [60, 60, 2] } }
        at_mm = [0, 0, 0]
        [[part]]
        name = "socket"
        at_mm = [3, 4, 5]
        turn_deg = 90
        [[part.solid]]
        shape = { block = { size_mm = [20, 10, 5] } }
        at_mm = [0, 0, 0]
        [[part.solid.cut]]
        shape = { cylinder = { diameter_mm = 1, depth_mm = 2 } }
        repeat = [3, 2]
        pitch_mm = [2.54, 7.62]
    "#;

    #[test]
    fn repeated_holes_are_where_the_file_puts_them() {
        let scene = Scene::new(SceneSpec::parse(TEXT).unwrap()).unwrap();
        // Part position (2.54, 3.81) turned by 90 degrees is (-3.81, 2.54) about the part's origin.
        let hit = scene.hit(&Vec3::new(3.0 - 3.81, 4.0 + 2.54, 50.0), &-Vec3::z(), 1e9).unwrap();
        assert!((hit.point.z - 3.0).abs() < 1e-12);
        assert_eq!(scene.part_near(&hit.point), Some(0));
        assert!((scene.distance(&Vec3::new(3.0, 4.0, 5.1)) - 0.1).abs() < 1e-12);
        assert!(!scene.clear(&Vec3::new(-9.0, 4.0, 0.5), &Vec3::new(15.0, 4.0, 0.5)));
        assert!(scene.clear(&Vec3::new(-9.0, 4.0, 0.5), &Vec3::new(-9.0, 4.0, 50.0)));
    }

    #[test]
    fn unknown_keys_and_senseless_sizes_are_refused() {
        assert!(SceneSpec::parse(&TEXT.replace("turn_deg", "turn")).is_err());
        let spec = SceneSpec::parse(&TEXT.replace("diameter_mm = 1", "diameter_mm = -1")).unwrap();
        assert!(Scene::new(spec).unwrap_err().what.contains("-1 mm"));
    }
}
