//! In: a scene file (TOML) of blocks, cylinders, balls and parts. Out: its content, checked.
//! Frame and unit: scene frame, z up, mm; the file's keys are in docs/file-formats.md, Scene file.

use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Vec3};
use crate::simulate::solid::Shape;
use std::path::Path;

/// Largest coordinate, mm, and largest rotation, degrees.
pub(super) const FARTHEST: f64 = 1e5;

/// Content of a scene file.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Name in reports and in truth.json.
    pub name: String,
    /// Region that the scan covers: x0, y0, x1, y1, mm.
    pub region_mm: [f64; 4],
    /// Height at which the sheet meets the optical axis, mm: the middle of the part's heights.
    #[serde(default)]
    pub focus_height_mm: f64,
    /// Solids in the scene's frame.
    #[serde(default)]
    pub solid: Vec<SolidSpec>,
    /// Groups of solids, each with a separate frame.
    #[serde(default)]
    pub part: Vec<PartSpec>,
}

/// Solids that belong together, in a common frame whose pose truth.json reports.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartSpec {
    /// Name in truth.json.
    pub name: String,
    /// The part's origin in the scene, mm.
    pub at_mm: [f64; 3],
    /// Rotation about z, degrees.
    #[serde(default)]
    pub turn_deg: f64,
    /// Subsequent tilts about the scene's x and y, degrees.
    #[serde(default)]
    pub tilt_deg: [f64; 2],
    /// Solids in the part's frame.
    #[serde(default)]
    pub solid: Vec<SolidSpec>,
}

/// A convex shape with cut-outs. `at_mm` is the middle of its top face.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidSpec {
    /// Outer shape.
    pub shape: ShapeSpec,
    /// Middle of the top face in the scene, or in the part that the solid belongs to, mm.
    pub at_mm: [f64; 3],
    /// Rotation about z, degrees.
    #[serde(default)]
    pub turn_deg: f64,
    /// Material of all its faces, including those of cut-outs.
    #[serde(default)]
    pub material: Material,
    /// Holes and pockets; none unless stated.
    #[serde(default)]
    pub cut: Vec<CutSpec>,
    /// Copies [along x, along y] ...
    #[serde(default = "one")]
    pub repeat: [u32; 2],
    /// ... this far apart, centred on `at_mm`.
    #[serde(default)]
    pub pitch_mm: [f64; 2],
}

/// A cut-out; `at_mm` is the middle of its opening in the solid's frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutSpec {
    /// Shape of the removed volume.
    pub shape: ShapeSpec,
    /// Middle of the opening, mm; origin and default are the middle of the solid's top face.
    #[serde(default)]
    pub at_mm: [f64; 3],
    /// Rotation about z, degrees.
    #[serde(default)]
    pub turn_deg: f64,
    /// Copies [along x, along y]; one unless stated.
    #[serde(default = "one")]
    pub repeat: [u32; 2],
    /// Distance of the copies [along x, along y], mm; they are centred on `at_mm`.
    #[serde(default)]
    pub pitch_mm: [f64; 2],
}

fn one() -> [u32; 2] {
    [1, 1]
}

/// A shape. Sizes are 0.001..=100000 mm, and the shape lies below its top face at z = 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeSpec {
    /// Size x, y, z.
    Block {
        /// Size along x, y, z, mm.
        size_mm: [f64; 3],
    },
    /// A block whose top falls by `drop_mm` from its -x to its +x side.
    Wedge {
        /// Size along x, y, z, mm; z at the high side.
        size_mm: [f64; 3],
        /// Fall of the top, mm; less than the size along z.
        drop_mm: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Diameter, mm.
        diameter_mm: f64,
        /// Height from top to bottom, mm.
        depth_mm: f64,
    },
    /// A frustum; as a cut-out it is a funnel.
    Cone {
        /// Diameter of the top, mm.
        top_mm: f64,
        /// Diameter of the bottom, mm.
        bottom_mm: f64,
        /// Height from top to bottom, mm.
        depth_mm: f64,
    },
    /// A ball that touches z = 0 from below.
    Ball {
        /// Diameter, mm.
        diameter_mm: f64,
    },
}

/// How a surface reflects light.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    /// Diffuse reflectance, 0..=1.
    pub albedo: f64,
    /// Share reflected as by a mirror, 0..=1; it causes false stripes on neighbouring surfaces.
    pub mirror: f64,
    /// Strength of the gloss seen by the camera, 0..=20, relative to a white matte surface ...
    pub gloss: f64,
    /// ... and its Phong exponent, 1..=500: larger is narrower.
    pub gloss_exponent: f64,
}

impl Default for Material {
    fn default() -> Self {
        Material { albedo: 0.6, mirror: 0.0, gloss: 0.0, gloss_exponent: 40.0 }
    }
}

impl ShapeSpec {
    pub(super) fn build(&self) -> Result<Shape> {
        let block =
            |s: [f64; 3], drop| (Shape::Block { half: [s[0] / 2.0, s[1] / 2.0], depth: s[2], drop }, s.to_vec());
        let (shape, sizes) = match *self {
            ShapeSpec::Block { size_mm } => block(size_mm, 0.0),
            ShapeSpec::Wedge { size_mm, drop_mm } => {
                let (shape, mut sizes) = block(size_mm, drop_mm);
                sizes.extend([drop_mm, size_mm[2] - drop_mm]);
                (shape, sizes)
            }
            ShapeSpec::Cylinder { diameter_mm: d, depth_mm: depth } => {
                (Shape::Cone { top: d / 2.0, bottom: d / 2.0, depth }, vec![d, depth])
            }
            ShapeSpec::Cone { top_mm, bottom_mm, depth_mm: depth } => {
                (Shape::Cone { top: top_mm / 2.0, bottom: bottom_mm / 2.0, depth }, vec![top_mm, bottom_mm, depth])
            }
            ShapeSpec::Ball { diameter_mm: d } => (Shape::Ball { radius: d / 2.0 }, vec![d]),
        };
        match sizes.iter().find(|s| !(1e-3..=1e5).contains(*s)) {
            Some(bad) => Err(Fault::input(format!("a {self:?} has a size of {bad} mm, allowed 0.001..=100000"))
                .cause("a missing or negative size in the scene file")
                .next("correct the shape")),
            None => Ok(shape),
        }
    }
}

impl SceneSpec {
    /// Reads and checks a scene file.
    pub fn load(path: &Path) -> Result<SceneSpec> {
        let text = crate::files::read_text(path)?;
        SceneSpec::parse(&text).map_err(|e| e.at(path.display()))
    }
    /// Reads and checks a scene file's text; the solids are checked by `Scene::new`.
    pub fn parse(text: &str) -> Result<SceneSpec> {
        let spec: SceneSpec = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a scene file: {e}"))
                .cause(crate::files::slip_at(text, e.span().map_or(0, |s| s.start), "a misspelt key or a missing size"))
                .next("compare it with docs/file-formats.md, Scene file")
        })?;
        let [x0, y0, x1, y1] = spec.region_mm;
        let span = |low: f64, high: f64| (0.1..=FARTHEST).contains(&(high - low));
        if !(span(x0, x1) && span(y0, y1)) {
            return Err(Fault::input(format!(
                "region_mm {:?} spans less than 0.1 or more than {FARTHEST} mm",
                spec.region_mm
            ))
            .next("give x0, y0, x1, y1 with x0 < x1 and y0 < y1"));
        }
        Ok(spec)
    }
}

impl PartSpec {
    /// Rotation and translation, mm: part frame to scene frame.
    pub fn scene_from_part(&self) -> (Mat3, Vec3) {
        let axis = |v: Vec3, deg: f64| crate::geometry::exp(&(v * deg.to_radians()));
        let r = axis(Vec3::y(), self.tilt_deg[1]) * axis(Vec3::x(), self.tilt_deg[0]) * axis(Vec3::z(), self.turn_deg);
        (r, Vec3::from(self.at_mm))
    }
}
