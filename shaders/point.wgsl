// In: chosen peaks, the rig, a pose a shot. Out: points in the poses' frame with their standard deviation; bits `none`
// where there is no point. Twin and reasons: src/stages/point.rs; docs/math.md, Stripe peak (7), (8). Frame and unit: mm.
struct PointFrame {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    skew: f32,
    k1: f32,
    k2: f32,
    p1: f32,
    p2: f32,
    k3: f32,
    normal_x: f32,
    normal_y: f32,
    normal_z: f32,
    offset: f32,
    none: u32,
    reserved: u32,
}

@group(0) @binding(0) var<uniform> rig: PointFrame;
@group(0) @binding(1) var<storage, read> header: array<u32>;
@group(0) @binding(2) var<storage, read> poses: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> peaks: array<Peak>;
@group(0) @binding(4) var<storage, read_write> spots: array<vec4<f32>>;

const NO_POINT = 9u;
const NEWTON = 5u;

fn row(r: vec4<f32>, p: vec3<f32>) -> f32 {
    return (r.x * p.x + r.y * p.y) + (r.z * p.z + r.w);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[3] {
        let k = peaks[id.x];
        let yd = (k.v - rig.cy) / rig.fy;
        let xd = (k.u - rig.cx - rig.skew * yd) / rig.fx;
        var x = xd;
        var y = yd;
        var det = 1.0;
        for (var i = 0u; i < NEWTON; i++) {
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (rig.k1 + r2 * (rig.k2 + r2 * rig.k3));
            let bend = rig.k1 + r2 * (2.0 * rig.k2 + 3.0 * rig.k3 * r2);
            let ex = (x * radial - xd) + (2.0 * rig.p1 * (x * y) + rig.p2 * (r2 + 2.0 * (x * x)));
            let ey = (y * radial - yd) + (rig.p1 * (r2 + 2.0 * (y * y)) + 2.0 * rig.p2 * (x * y));
            let a = (radial + 2.0 * (x * x) * bend) + (2.0 * rig.p1 * y + 6.0 * rig.p2 * x);
            let b = 2.0 * (x * y) * bend + (2.0 * rig.p1 * x + 2.0 * rig.p2 * y);
            let d = (radial + 2.0 * (y * y) * bend) + (6.0 * rig.p1 * y + 2.0 * rig.p2 * x);
            det = a * d - b * b;
            x -= (d * ex - b * ey) / det;
            y -= (a * ey - b * ex) / det;
        }
        let slope = rig.normal_x * x + (rig.normal_y * y + rig.normal_z);
        let z = rig.offset / slope;
        let there = det > 0.0 && abs(x) < 1e9 && abs(y) < 1e9 && slope > 1e-6 && z < 1e6;
        // One pixel along the peak's normal: dx, dy of the ray, dz from the plane.
        let dx = k.normal_u / rig.fx;
        let dy = k.normal_v / rig.fy;
        let dz = -z * (rig.normal_x * dx + rig.normal_y * dy) / slope;
        let ex = dz * x + z * dx;
        let ey = dz * y + z * dy;
        let sigma = sqrt(ex * ex + (ey * ey + dz * dz)) * k.sigma_px;
        let p = vec3(x * z, y * z, z);
        let spot = vec4(row(poses[3u * k.shot], p), row(poses[3u * k.shot + 1u], p), row(poses[3u * k.shot + 2u], p), sigma);
        let kept = (k.flags & 255u) == 0u;
        spots[id.x] = select(vec4(bitcast<f32>(rig.none)), spot, kept && there);
        peaks[id.x].flags = select(k.flags, k.flags | NO_POINT, kept && !there);
    }
}
