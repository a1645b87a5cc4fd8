//! In: a rig's design. Out: a scene that fills its field, and the recipe that finds the plate in it. The scene is a
//! stepped block beside a plate with a notch, a window and a hole.
//! Frame and unit: scene frame, z up, the laser on the -y side; mm. Lengths are the default rig's times the rig's
//! scale.

use super::rig::RigSpec;
use super::scene::{CutSpec, Material, PartSpec, SceneSpec, ShapeSpec, SolidSpec};

/// Rises from tread to tread on the default rig, mm.
pub const STEPS_MM: [f64; 4] = [0.1, 0.5, 1.0, 5.0];
/// Width (along the stripe) and length of a tread on the default rig, mm.
pub const TREAD_MM: [f64; 2] = [12.0, 24.0];
/// Height of the plate that everything stands on, and the notched part's thickness, mm.
const FLOOR_MM: f64 = -6.0;
const PART_MM: f64 = 5.0;

fn block(size: [f64; 3], at: [f64; 3], albedo: f64) -> SolidSpec {
    SolidSpec {
        shape: ShapeSpec::Block { size_mm: size },
        at_mm: at,
        turn_deg: 0.0,
        material: Material { albedo, ..Material::default() },
        cut: vec![],
        repeat: [1, 1],
        pitch_mm: [0.0; 2],
    }
}

fn cut(shape: ShapeSpec, at: [f64; 2]) -> CutSpec {
    CutSpec { shape, at_mm: [at[0], at[1], 0.0], turn_deg: 0.0, repeat: [1, 1], pitch_mm: [0.0; 2] }
}

impl RigSpec {
    /// The scene of this rig's scans if none is named.
    pub fn scene(&self) -> SceneSpec {
        let u = self.scale();
        let s = |v: [f64; 3]| v.map(|x| x * u);
        let mut steps = Vec::new();
        let mut top = 0.0;
        for (i, rise) in [0.0].iter().chain(&STEPS_MM).enumerate() {
            top += rise;
            let size = [TREAD_MM[0], TREAD_MM[1], top - FLOOR_MM];
            steps.push(block(s(size), s([TREAD_MM[0] * (i as f64 - 2.0), 0.0, top]), 0.8));
        }
        let mut part = block(s([36.0, 24.0, PART_MM]), [0.0; 3], 0.6);
        // The cuts go through the plate, so that the floor is visible.
        let through = 2.0 * PART_MM;
        part.cut = vec![
            cut(ShapeSpec::Block { size_mm: s([6.0, 8.0, through]) }, [-18.0 * u, 4.0 * u]),
            cut(ShapeSpec::Block { size_mm: s([10.0, 10.0, through]) }, [7.0 * u, -2.0 * u]),
            cut(ShapeSpec::Cylinder { diameter_mm: 7.0 * u, depth_mm: through * u }, [-7.0 * u, -4.0 * u]),
        ];
        let placed = |name: &str, at: [f64; 3], turn_deg, solid| PartSpec {
            name: name.into(),
            at_mm: s(at),
            turn_deg,
            tilt_deg: [0.0; 2],
            solid,
        };
        SceneSpec {
            name: "stepped block and notched plate".into(),
            region_mm: [-52.0 * u, -15.0 * u, 52.0 * u, 15.0 * u],
            focus_height_mm: 0.0,
            solid: vec![block(s([220.0, 120.0, 5.0]), [0.0, 0.0, FLOOR_MM * u], 0.5)],
            part: vec![
                placed("steps", [-20.0, 0.0, 0.0], 0.0, steps),
                placed("notched", [31.0, 0.0, FLOOR_MM + PART_MM], 3.0, vec![part]),
            ],
        }
    }

    /// Number of shots of a scan of that scene in steps of one and a half pixel footprints.
    pub fn shots(&self) -> usize {
        self.shots_over(32.0 * self.scale())
    }

    /// The recipe (TOML) of the notched part, for scans of `shots` shots.
    pub fn recipe(&self, shots: usize) -> String {
        let u = self.scale();
        let step = (32.0 * u / (shots.max(2) - 1) as f64).max(self.footprint_mm());
        let list = |points: &[[f64; 2]]| {
            let each: Vec<String> = points.iter().map(|p| format!("[{:.6}, {:.6}]", p[0] * u, p[1] * u)).collect();
            each.join(", ")
        };
        let outline = list(&[
            [-18.0, -12.0],
            [18.0, -12.0],
            [18.0, 12.0],
            [-18.0, 12.0],
            [-18.0, 8.0],
            [-15.0, 8.0],
            [-15.0, 0.0],
            [-18.0, 0.0],
        ]);
        format!(
            "# The notched plate that `sheetlight simulate --rig` puts before the rig \"{name}\"; mm, degrees.\n\
             format = 1\nname = \"notched\"\ntitle = \"Plate with notch, window and hole\"\ncell_mm = {cell:.6}\n\n\
             [search]\nmin_score = 0.5\n\n\
             [measure]\nheight_gate_mm = {gate:.6}\nedge_gate_mm = {edge:.6}\nmargin_mm = {margin:.6}\n\n\
             [[shape]]\nkind = \"polygon\"\npoints = [{outline}]\n\n\
             [[shape]]\nkind = \"rectangle\"\ninside = \"low\"\ncentre = {window}\nsize = {size}\n\n\
             [[shape]]\nkind = \"circle\"\ninside = \"low\"\ncentre = {hole}\nradius = {radius:.6}\n\n\
             [insertion]\napproach_mm = {above:.6}\nretract_mm = {above:.6}\ntolerance_mm = {bears:.6}\n\
             tolerance_deg = 0.5\n\n\
             [gates]\nmax_sigma_mm = {sigma:.6}\n\n[robot]\nsigma_mm = 0\nsigma_deg = 0\n",
            name = self.name.replace('"', "'"),
            cell = 1.4 * step,
            gate = 0.4 * u,
            edge = (0.45 * u).max(1.2 * step),
            margin = (0.5 * u).max(1.2 * step),
            window = list(&[[7.0, -2.0]]),
            size = list(&[[10.0, 10.0]]),
            hole = list(&[[-7.0, -4.0]]),
            radius = 3.5 * u,
            above = 30.0 * u,
            bears = (0.3 * u).max(step),
            sigma = (0.1 * u).max(0.3 * step),
        )
    }
}
