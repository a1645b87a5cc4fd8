//! In: camera, laser plane, lines across the stripe. Out: the same in f32 for the stage that computes points, and its
//! uniform block. Frame and unit: camera frame, px, mm; stated at each field.

use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Camera, Plane};
use crate::stages::stripe::choose::Lines;
use glam::{DVec3, Vec2, Vec3};

/// Camera and laser plane in the stage's format: f32, in the camera frame.
#[derive(Clone, Copy, Debug)]
pub struct Optics {
    /// fx, fy, cx, cy, skew; px.
    pub pinhole: [f32; 5],
    /// k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4.
    pub distortion: [f32; 12],
    /// From the tilted sensor back to the plane on which the lens forms the image, row by row.
    pub untilt: [f32; 9],
    /// Unit normal of the laser plane: normal · X = offset, mm, with a positive offset.
    pub normal: Vec3,
    /// Distance of the plane from the camera's centre, mm.
    pub offset: f32,
}

impl Optics {
    /// Rounded to f32; the plane's normal is turned so that its offset is positive.
    pub fn new(camera: &Intrinsics, laser: &Plane<Camera>) -> Optics {
        let laser = if laser.offset < 0.0 { laser.flipped() } else { *laser };
        Optics {
            pinhole: [camera.fx, camera.fy, camera.cx, camera.cy, camera.skew].map(|v| v as f32),
            distortion: std::array::from_fn(|i| camera.distortion[i] as f32),
            untilt: untilt(&camera.distortion),
            normal: DVec3::from_array(laser.normal.into()).as_vec3(),
            offset: laser.offset as f32,
        }
    }
    /// Whether Brown-Conrady's five terms describe the lens completely: then the stage has no other terms.
    #[inline]
    pub fn plain(&self) -> bool {
        self.distortion[5..].iter().all(|t| *t == 0.0) && self.untilt == FLAT
    }
    /// The value of the override [`crate::stages::stripe::point::FULL_LENS`].
    pub fn full_lens(&self) -> f64 {
        f64::from(u8::from(!self.plain()))
    }
    /// Unit image direction in which the stripe moves with depth: the plane's normal without its z component.
    pub fn across(&self) -> Vec2 {
        let across = self.normal.truncate();
        let l = across.length();
        if l > 1e-6 { across / l } else { Vec2::Y }
    }
}

/// The matrix of a sensor without tilt.
pub const FLAT: [f32; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn untilt(lens: &Distortion) -> [f32; 9] {
    let back = lens.tilt().and_then(|t| t[0].try_inverse());
    // Row 3 column 3 is scaled to 1: the matrix maps rays, so its scale is free.
    back.map_or(FLAT, |t| std::array::from_fn(|i| (t[(i / 3, i % 3)] / t.m33) as f32))
}

/// The uniform block of the stage; the WGSL struct of the same name, shaders/point.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PointFrame {
    /// Focal length along the rows, px.
    pub fx: f32,
    /// Focal length along the columns, px.
    pub fy: f32,
    /// Principal point, px from the middle of the left column.
    pub cx: f32,
    /// Principal point, px from the middle of the top row.
    pub cy: f32,
    /// Shear of the pixel grid: u grows by this many px if y grows by 1 on the plane z = 1.
    pub skew: f32,
    /// Radial distortion, numerator: r².
    pub k1: f32,
    /// Radial distortion, numerator: r⁴.
    pub k2: f32,
    /// Tangential distortion: 2 xy along the rows, r² + 2 y² along the columns.
    pub p1: f32,
    /// Tangential distortion: r² + 2 x² along the rows, 2 xy along the columns.
    pub p2: f32,
    /// Radial distortion, numerator: r⁶.
    pub k3: f32,
    /// Radial distortion, denominator: r².
    pub k4: f32,
    /// Radial distortion, denominator: r⁴.
    pub k5: f32,
    /// Radial distortion, denominator: r⁶.
    pub k6: f32,
    /// Thin prism along the rows: r².
    pub s1: f32,
    /// Thin prism along the rows: r⁴.
    pub s2: f32,
    /// Thin prism along the columns: r².
    pub s3: f32,
    /// Thin prism along the columns: r⁴.
    pub s4: f32,
    /// [`Optics::untilt`], row 1, column 1.
    pub t0: f32,
    /// Row 1, column 2.
    pub t1: f32,
    /// Row 1, column 3.
    pub t2: f32,
    /// Row 2, column 1.
    pub t3: f32,
    /// Row 2, column 2.
    pub t4: f32,
    /// Row 2, column 3.
    pub t5: f32,
    /// Row 3, column 1.
    pub t6: f32,
    /// Row 3, column 2.
    pub t7: f32,
    /// Row 3, column 3.
    pub t8: f32,
    /// The laser plane's unit normal, camera frame: x.
    pub normal_x: f32,
    /// The laser plane's unit normal, camera frame: y.
    pub normal_y: f32,
    /// The laser plane's unit normal, camera frame: z.
    pub normal_z: f32,
    /// Distance of the laser plane from the camera's centre, mm.
    pub offset: f32,
    /// Bits of the number that means "no point" (NaN), which a shader cannot write as a literal.
    pub none: u32,
    /// Number of lines, as in [`Lines`].
    pub lines: u32,
    /// 1 if the lines are columns, as in [`Lines`].
    pub columns: u32,
    /// Columns or rows in a line, px, as in [`Lines`].
    pub line_px: u32,
    /// [`Lines::reach`], lines.
    pub echo_reach: i32,
    /// Least amplitude over the strongest nearby, as in [`Lines`], 0..=1.
    pub echo: f32,
    /// Width below which a peak may be a cut spot, as in [`Lines`], px.
    pub cut_width: f32,
    /// Least amplitude of such a peak over the strongest nearby, as in [`Lines`], 0..=1.
    pub cut_amplitude: f32,
    /// Always 0: fills the block to a multiple of 16 bytes.
    pub reserved_1: u32,
    /// Always 0, like the field before.
    pub reserved_2: u32,
}

impl PointFrame {
    /// The block of this rig and these lines.
    pub fn new(o: &Optics, l: &Lines) -> PointFrame {
        let ([fx, fy, cx, cy, skew], [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]) = (o.pinhole, o.distortion);
        let [t0, t1, t2, t3, t4, t5, t6, t7, t8] = o.untilt;
        let [normal_x, normal_y, normal_z] = o.normal.to_array();
        let none = f32::NAN.to_bits();
        PointFrame {
            fx,
            fy,
            cx,
            cy,
            skew,
            k1,
            k2,
            p1,
            p2,
            k3,
            k4,
            k5,
            k6,
            s1,
            s2,
            s3,
            s4,
            t0,
            t1,
            t2,
            t3,
            t4,
            t5,
            t6,
            t7,
            t8,
            normal_x,
            normal_y,
            normal_z,
            offset: o.offset,
            none,
            lines: l.lines,
            columns: l.columns,
            line_px: l.line_px,
            echo_reach: l.reach,
            echo: l.echo,
            cut_width: l.cut_width,
            cut_amplitude: l.cut_amplitude,
            reserved_1: 0,
            reserved_2: 0,
        }
    }
    /// Camera and laser plane of the block.
    pub fn optics(&self) -> Optics {
        Optics {
            pinhole: [self.fx, self.fy, self.cx, self.cy, self.skew],
            distortion: [
                self.k1, self.k2, self.p1, self.p2, self.k3, self.k4, self.k5, self.k6, self.s1, self.s2, self.s3,
                self.s4,
            ],
            untilt: [self.t0, self.t1, self.t2, self.t3, self.t4, self.t5, self.t6, self.t7, self.t8],
            normal: Vec3::new(self.normal_x, self.normal_y, self.normal_z),
            offset: self.offset,
        }
    }
    /// Lines of the block.
    pub fn lines(&self) -> Lines {
        Lines {
            lines: self.lines,
            columns: self.columns,
            line_px: self.line_px,
            reach: self.echo_reach,
            echo: self.echo,
            cut_width: self.cut_width,
            cut_amplitude: self.cut_amplitude,
        }
    }
}
