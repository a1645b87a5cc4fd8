//! In: convex shapes, bodies with cut-outs, rays. Out: the point where a ray enters a body, and a point's distance
//! from the body's surface.
//! Frame and unit: body frame: origin in the middle of the top face, z up, mm.

use crate::geometry::Vec3;

/// A convex shape below the origin's plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// |x| <= half[0], |y| <= half[1], -depth <= z <= 0; the top falls by `drop` from -x to +x.
    Block { half: [f64; 2], depth: f64, drop: f64 },
    /// A frustum of radius `top` at z = 0 and `bottom` at z = -depth.
    Cone { top: f64, bottom: f64, depth: f64 },
    /// A ball that touches z = 0 from below.
    Ball { radius: f64 },
}

/// Interval of a ray inside a convex shape: distances along it and outward normals.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    pub enter: (f64, Vec3),
    pub leave: (f64, Vec3),
}

/// Narrows `span` by a half-space `normal · X <= offset`; false when nothing is left.
fn clip(span: &mut Span, normal: Vec3, offset: f64, o: &Vec3, d: &Vec3) -> bool {
    let (height, slope) = (normal.dot(o) - offset, normal.dot(d));
    if slope.abs() < 1e-15 {
        return height <= 0.0;
    }
    let t = -height / slope;
    if slope < 0.0 && t > span.enter.0 {
        span.enter = (t, normal);
    }
    if slope > 0.0 && t < span.leave.0 {
        span.leave = (t, normal);
    }
    span.enter.0 < span.leave.0
}

impl Shape {
    /// Half extents [x, y] and depth, for bounding volumes.
    pub fn bounds(&self) -> ([f64; 2], f64) {
        match *self {
            Shape::Block { half, depth, .. } => (half, depth),
            Shape::Cone { top, bottom, depth } => ([top.max(bottom); 2], depth),
            Shape::Ball { radius } => ([radius; 2], 2.0 * radius),
        }
    }

    fn slope_normal(half: f64, drop: f64) -> Vec3 {
        Vec3::new(drop, 0.0, 2.0 * half).normalize()
    }

    /// The part of the line `o + t d` inside the shape.
    pub fn span(&self, o: &Vec3, d: &Vec3) -> Option<Span> {
        let far = Vec3::zeros();
        let mut s = Span { enter: (f64::NEG_INFINITY, far), leave: (f64::INFINITY, far) };
        let inside = match *self {
            Shape::Block { half, depth, drop } => {
                let top = if drop == 0.0 {
                    (Vec3::z(), 0.0)
                } else {
                    let n = Self::slope_normal(half[0], drop);
                    (n, n.dot(&Vec3::new(-half[0], 0.0, 0.0)))
                };
                clip(&mut s, Vec3::x(), half[0], o, d)
                    && clip(&mut s, -Vec3::x(), half[0], o, d)
                    && clip(&mut s, Vec3::y(), half[1], o, d)
                    && clip(&mut s, -Vec3::y(), half[1], o, d)
                    && clip(&mut s, top.0, top.1, o, d)
                    && clip(&mut s, -Vec3::z(), depth, o, d)
            }
            Shape::Cone { top, bottom, depth } => {
                // x² + y² = (top + k z)²; the other nappe is cut off by the end planes.
                let k = (top - bottom) / depth;
                let r = top + k * o.z;
                let a = d.x * d.x + d.y * d.y - k * k * d.z * d.z;
                let b = o.x * d.x + o.y * d.y - r * k * d.z;
                let c = o.x * o.x + o.y * o.y - r * r;
                clip(&mut s, Vec3::z(), 0.0, o, d) && clip(&mut s, -Vec3::z(), depth, o, d) && {
                    let normal = |t: f64| {
                        let p = o + d * t;
                        Vec3::new(p.x, p.y, -k * (top + k * p.z)).normalize()
                    };
                    narrow(&mut s, a, b, c, normal)
                }
            }
            Shape::Ball { radius } => {
                let m = o - Vec3::new(0.0, 0.0, -radius);
                let normal = |t: f64| ((m + d * t) / radius).normalize();
                narrow(&mut s, d.norm_squared(), m.dot(d), m.norm_squared() - radius * radius, normal)
            }
        };
        inside.then_some(s)
    }

    /// Signed distance, negative inside. Exact for blocks without drop, cylinders and balls; for
    /// sloped tops and cones exact near the faces and a lower bound beyond the edges.
    pub fn distance(&self, p: &Vec3) -> f64 {
        self.distance_with(p, false)
    }

    /// With `open` the top face is no surface: the shape continues upwards, as an opening does.
    fn distance_with(&self, p: &Vec3, open: bool) -> f64 {
        let ends = |depth: f64| if open { -depth - p.z } else { (p.z + depth / 2.0).abs() - depth / 2.0 };
        let combine = |q: &[f64]| {
            let outside = q.iter().map(|x| x.max(0.0).powi(2)).sum::<f64>().sqrt();
            outside + q.iter().copied().fold(f64::NEG_INFINITY, f64::max).min(0.0)
        };
        match *self {
            Shape::Block { half, depth, drop } => {
                let sides = [p.x.abs() - half[0], p.y.abs() - half[1]];
                if drop == 0.0 {
                    return combine(&[sides[0], sides[1], ends(depth)]);
                }
                let top = Self::slope_normal(half[0], drop).dot(&(p + Vec3::new(half[0], 0.0, 0.0)));
                sides[0].max(sides[1]).max(top).max(-depth - p.z)
            }
            Shape::Cone { top, bottom, depth } => {
                let k = (top - bottom) / depth;
                let side = (p.x.hypot(p.y) - top - k * p.z) / (1.0 + k * k).sqrt();
                combine(&[side, ends(depth)])
            }
            Shape::Ball { radius } => (p + Vec3::new(0.0, 0.0, radius)).norm() - radius,
        }
    }
}

/// Narrows a span to where `a t² + 2 b t + c <= 0`, for a quadric that is convex inside the span.
fn narrow(s: &mut Span, a: f64, b: f64, c: f64, normal: impl Fn(f64) -> Vec3) -> bool {
    if a.abs() < 1e-14 {
        if b.abs() < 1e-14 {
            return c <= 0.0;
        }
        let t = -c / (2.0 * b);
        if b > 0.0 && t < s.leave.0 {
            s.leave = (t, normal(t));
        }
        if b < 0.0 && t > s.enter.0 {
            s.enter = (t, normal(t));
        }
        return s.enter.0 < s.leave.0;
    }
    let root = b * b - a * c;
    if root <= 0.0 {
        return a < 0.0 && s.enter.0 < s.leave.0;
    }
    let root = root.sqrt();
    let (t0, t1) = ((-b - root) / a, (-b + root) / a);
    let (t0, t1) = (t0.min(t1), t0.max(t1));
    if a > 0.0 {
        if t0 > s.enter.0 {
            s.enter = (t0, normal(t0));
        }
        if t1 < s.leave.0 {
            s.leave = (t1, normal(t1));
        }
    } else if s.leave.0 <= t0 || s.enter.0 >= t1 {
        // Entirely on one nappe.
    } else if s.enter.0 < t0 && s.leave.0 <= t1 {
        s.leave = (t0, normal(t0));
    } else if s.enter.0 >= t0 && s.leave.0 > t1 {
        s.enter = (t1, normal(t1));
    } else if s.enter.0 >= t0 {
        return false;
    } else {
        // The end planes leave only one nappe; the part before t0 is taken.
        s.leave = (t0, normal(t0));
    }
    s.enter.0 < s.leave.0
}

/// A cut-out at a pose in the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    pub shape: Shape,
    /// Middle of the opening in the body's frame.
    pub at: Vec3,
    /// Cosine and sine of the rotation about z.
    pub turn: (f64, f64),
}

impl Cut {
    pub fn new(shape: Shape, at: Vec3, turn_deg: f64) -> Cut {
        let (sin, cos) = turn_deg.to_radians().sin_cos();
        Cut { shape, at, turn: (cos, sin) }
    }
    fn turned(&self, v: &Vec3, sign: f64) -> Vec3 {
        let (c, s) = (self.turn.0, sign * self.turn.1);
        Vec3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z)
    }
    fn span(&self, o: &Vec3, d: &Vec3) -> Option<Span> {
        self.shape.span(&self.turned(&(o - self.at), -1.0), &self.turned(d, -1.0))
    }
    /// Signed distance; an opening in the body's top continues upwards.
    fn distance(&self, p: &Vec3) -> f64 {
        self.shape.distance_with(&self.turned(&(p - self.at), -1.0), self.at.z >= -SKIN)
    }
}

/// A convex shape with convex cut-outs.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    pub shape: Shape,
    pub cuts: Vec<Cut>,
}

/// Distances below this belong to the surface that the ray starts on, mm.
const SKIN: f64 = 1e-6;

impl Body {
    /// First surface of the body after the start of the ray: distance and outward normal.
    pub fn hit(&self, o: &Vec3, d: &Vec3) -> Option<(f64, Vec3)> {
        let outer = self.shape.span(o, d)?;
        if outer.leave.0 <= SKIN {
            return None;
        }
        let mut at = outer.enter;
        // Inside a cut-out the ray is in air: move to its end, until the point is in no cut-out. The loop ends
        // because cut-outs are few and each is left once.
        for _ in 0..=self.cuts.len() {
            let mut moved = false;
            for cut in &self.cuts {
                let Some(s) = cut.span(o, d) else { continue };
                let inside = s.enter.0 <= at.0 + SKIN || (at.0 <= SKIN && s.enter.0 <= SKIN);
                if inside && s.leave.0 > at.0 + SKIN && (at.0 > SKIN || s.leave.0 > SKIN) {
                    at = (s.leave.0, -cut.turned(&s.leave.1, 1.0));
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
        (at.0 > SKIN && at.0 < outer.leave.0 - SKIN).then_some(at)
    }

    /// Signed distance of a point from the body's surface, negative inside. It is exact on faces and inside openings
    /// up to the nearest edge, and a lower bound beside the edges of cut-outs.
    pub fn distance(&self, p: &Vec3) -> f64 {
        let outer = self.shape.distance(p);
        self.cuts.iter().map(|c| -c.distance(p)).fold(outer, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn socket() -> Body {
        Body {
            shape: Shape::Block { half: [10.0, 6.0], depth: 4.0, drop: 0.0 },
            cuts: vec![
                Cut::new(Shape::Cone { top: 0.8, bottom: 0.4, depth: 2.0 }, Vec3::new(3.0, 1.0, 0.0), 0.0),
                Cut::new(Shape::Block { half: [2.0, 1.0], depth: 1.5, drop: 0.0 }, Vec3::new(-5.0, 0.0, 0.0), 0.0),
                Cut::new(Shape::Block { half: [2.0, 1.0], depth: 9.0, drop: 0.0 }, Vec3::new(9.5, 5.5, 0.0), 45.0),
            ],
        }
    }

    #[test]
    fn rays_reach_the_bottom_of_holes_and_the_top_beside_them() {
        let down = |x, y| socket().hit(&Vec3::new(x, y, 20.0), &-Vec3::z()).map(|(t, n)| (20.0 - t, n.z));
        assert_eq!(down(0.0, 0.0), Some((0.0, 1.0)));
        assert_eq!(down(3.0, 1.0), Some((-2.0, 1.0)));
        assert_eq!(down(-5.5, 0.5), Some((-1.5, 1.0)));
        assert_eq!(down(10.5, 0.0), None);
        // The corner is cut off through the full depth.
        assert_eq!(down(9.6, 5.6), None);
        // Air over a hole is not on the surface.
        assert!((socket().distance(&Vec3::new(-5.0, 0.0, 0.0)) - 1.0).abs() < 1e-12);
        // The wall of a slot, from inside.
        let (t, n) = socket().hit(&Vec3::new(-5.0, 0.0, -0.5), &Vec3::x()).unwrap();
        assert!((t - 2.0).abs() < 1e-12 && n.x == -1.0);
    }

    proptest! {
        /// Whatever a ray hits lies on the surface.
        #[test]
        fn hits_lie_on_the_surface(x in -12.0f64..12.0, y in -8.0f64..8.0, a in -1.0f64..1.0, b in -1.0f64..1.0) {
            let (o, d) = (Vec3::new(x - 10.0 * a, y - 10.0 * b, 10.0), Vec3::new(a, b, -1.0).normalize());
            for shape in [
                socket(),
                Body { shape: Shape::Block { half: [10.0, 6.0], depth: 4.0, drop: 2.5 }, cuts: vec![] },
                Body { shape: Shape::Cone { top: 3.0, bottom: 6.0, depth: 5.0 }, cuts: vec![] },
                Body { shape: Shape::Ball { radius: 5.0 }, cuts: vec![] },
            ] {
                if let Some((t, n)) = shape.hit(&o, &d) {
                    prop_assert!(shape.distance(&(o + d * t)).abs() < 1e-9, "{shape:?} {t}");
                    prop_assert!(n.dot(&d) < 1e-12, "{shape:?} {n}");
                } else {
                    let inside = (0..400).any(|i| {
                        let p = o + d * (0.1 * f64::from(i));
                        shape.shape.distance(&p) < -0.01 && shape.cuts.iter().all(|c| c.distance(&p) > 0.01)
                    });
                    prop_assert!(!inside, "{shape:?} missed");
                }
            }
        }
    }
}
