// In: peaks, the strongest of each line across the stripe, the rig, a pose a shot. Out: the reason of peaks that are weak
// beside another: echoes, and spots cut by an edge; of the others points in the poses' frame with their standard deviation, bits
// `none` where there is none. Twin and reasons: src/stages/choose.rs, point.rs; docs/math.md, Stripe peak (7), (8). Frame and unit: mm.
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
    lines: u32,
    columns: u32,
    line_px: u32,
    echo_reach: i32,
    echo: f32,
    cut_width: f32,
    cut_amplitude: f32,
    reserved_1: u32,
    reserved_2: u32,
}

@group(0) @binding(0) var<uniform> frame: PointFrame;
@group(0) @binding(1) var<storage, read> header: array<u32>;
@group(0) @binding(2) var<storage, read> poses: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> strongest: array<u32>;
@group(0) @binding(4) var<storage, read_write> peaks: array<Peak>;
@group(0) @binding(5) var<storage, read_write> spots: array<vec4<f32>>;

const NARROW = 3u;
const ECHO = 7u;
const NO_POINT = 9u;
const NEWTON = 5u;

// The reason against a peak beside the strongest of the lines nearby.
fn beside(k: Peak) -> u32 {
    let along = i32(line_of(k.pixel));
    let low = max(along - frame.echo_reach, 0);
    let high = min(along + frame.echo_reach, i32(frame.lines) - 1);
    var bits = 0u;
    for (var i = low; i <= high; i++) {
        bits = max(bits, strongest[k.shot * frame.lines + u32(i)]);
    }
    let top = bitcast<f32>(bits);
    let cut = k.width_px < frame.cut_width && k.amplitude < frame.cut_amplitude * top;
    return select(select(0u, NARROW, cut), ECHO, k.amplitude < frame.echo * top);
}

fn row(r: vec4<f32>, p: vec3<f32>) -> f32 {
    return (r.x * p.x + r.y * p.y) + (r.z * p.z + r.w);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[3] {
        let k = peaks[id.x];
        let yd = (k.v - frame.cy) / frame.fy;
        let xd = (k.u - frame.cx - frame.skew * yd) / frame.fx;
        var x = xd;
        var y = yd;
        var det = 1.0;
        for (var i = 0u; i < NEWTON; i++) {
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (frame.k1 + r2 * (frame.k2 + r2 * frame.k3));
            let bend = frame.k1 + r2 * (2.0 * frame.k2 + 3.0 * frame.k3 * r2);
            let ex = (x * radial - xd) + (2.0 * frame.p1 * (x * y) + frame.p2 * (r2 + 2.0 * (x * x)));
            let ey = (y * radial - yd) + (frame.p1 * (r2 + 2.0 * (y * y)) + 2.0 * frame.p2 * (x * y));
            let a = (radial + 2.0 * (x * x) * bend) + (2.0 * frame.p1 * y + 6.0 * frame.p2 * x);
            let b = 2.0 * (x * y) * bend + (2.0 * frame.p1 * x + 2.0 * frame.p2 * y);
            let d = (radial + 2.0 * (y * y) * bend) + (6.0 * frame.p1 * y + 2.0 * frame.p2 * x);
            det = a * d - b * b;
            x -= (d * ex - b * ey) / det;
            y -= (a * ey - b * ex) / det;
        }
        let slope = frame.normal_x * x + (frame.normal_y * y + frame.normal_z);
        let z = frame.offset / slope;
        let there = det > 0.0 && abs(x) < 1e9 && abs(y) < 1e9 && slope > 1e-6 && z < 1e6;
        // One pixel along the peak's normal: dx, dy of the ray, dz from the plane.
        let dx = k.normal_u / frame.fx;
        let dy = k.normal_v / frame.fy;
        let dz = -z * (frame.normal_x * dx + frame.normal_y * dy) / slope;
        let ex = dz * x + z * dx;
        let ey = dz * y + z * dy;
        let sigma = sqrt(ex * ex + (ey * ey + dz * dz)) * k.sigma_px;
        let p = vec3(x * z, y * z, z);
        let spot = vec4(row(poses[3u * k.shot], p), row(poses[3u * k.shot + 1u], p), row(poses[3u * k.shot + 2u], p), sigma);
        // The first reason stays.
        let alone = k.flags & 255u;
        let compared = select(alone, beside(k), alone == 0u);
        let why = select(compared, NO_POINT, compared == 0u && !there);
        spots[id.x] = select(vec4(bitcast<f32>(frame.none)), spot, why == 0u);
        peaks[id.x].flags = k.flags | why;
    }
}
