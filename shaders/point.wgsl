// Rejects peaks that are weak beside the strongest on the lines nearby: echoes, and spots cut by an edge. Computes the
// points of the others in the poses' frame, mm, with their standard deviation. A rejected peak's point has the bits
// `none`. Twin and reasons: src/stages/stripe/choose.rs, point.rs; docs/math.md, Stripe peak (7), (8).
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
    k4: f32,
    k5: f32,
    k6: f32,
    s1: f32,
    s2: f32,
    s3: f32,
    s4: f32,
    t0: f32,
    t1: f32,
    t2: f32,
    t3: f32,
    t4: f32,
    t5: f32,
    t6: f32,
    t7: f32,
    t8: f32,
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
@group(0) @binding(5) var<storage, read_write> points: array<vec4<f32>>;

// 1: the lens has terms beyond Brown-Conrady's five, or its sensor is tilted.
override full_lens: u32 = 0u;

const NEWTON = 5u;

// The reason for rejecting a peak from a comparison with the strongest peaks of the lines nearby, or 0.
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
    if id.x < header[COUNT] {
        let k = peaks[id.x];
        let yv = (k.v - frame.cy) / frame.fy;
        let xv = (k.u - frame.cx - frame.skew * yv) / frame.fx;
        // Change of the ray for one pixel along the peak's normal.
        let dv = k.normal_v / frame.fy;
        let du = (k.normal_u - frame.skew * dv) / frame.fx;
        var xd = xv;
        var yd = yv;
        var dxd = du;
        var dyd = dv;
        if full_lens == 1u {
            // From the tilted sensor to a sensor that is not tilted.
            let w = frame.t6 * xv + (frame.t7 * yv + frame.t8);
            xd = (frame.t0 * xv + (frame.t1 * yv + frame.t2)) / w;
            yd = (frame.t3 * xv + (frame.t4 * yv + frame.t5)) / w;
            dxd = ((frame.t0 - xd * frame.t6) * du + (frame.t1 - xd * frame.t7) * dv) / w;
            dyd = ((frame.t3 - yd * frame.t6) * du + (frame.t4 - yd * frame.t7) * dv) / w;
        }
        var x = xd;
        var y = yd;
        var a = 1.0;
        var b = 0.0;
        var c = 0.0;
        var d = 1.0;
        var det = 1.0;
        for (var i = 0u; i < NEWTON; i++) {
            let r2 = x * x + y * y;
            var radial = 1.0 + r2 * (frame.k1 + r2 * (frame.k2 + r2 * frame.k3));
            var bend = frame.k1 + r2 * (2.0 * frame.k2 + 3.0 * frame.k3 * r2);
            if full_lens == 1u {
                let below = 1.0 + r2 * (frame.k4 + r2 * (frame.k5 + r2 * frame.k6));
                radial /= below;
                bend = (bend - radial * (frame.k4 + r2 * (2.0 * frame.k5 + 3.0 * frame.k6 * r2))) / below;
            }
            var ex = (x * radial - xd) + (2.0 * frame.p1 * (x * y) + frame.p2 * (r2 + 2.0 * (x * x)));
            var ey = (y * radial - yd) + (frame.p1 * (r2 + 2.0 * (y * y)) + 2.0 * frame.p2 * (x * y));
            a = (radial + 2.0 * (x * x) * bend) + (2.0 * frame.p1 * y + 6.0 * frame.p2 * x);
            b = 2.0 * (x * y) * bend + (2.0 * frame.p1 * x + 2.0 * frame.p2 * y);
            c = b;
            d = (radial + 2.0 * (y * y) * bend) + (6.0 * frame.p1 * y + 2.0 * frame.p2 * x);
            if full_lens == 1u {
                let px = 2.0 * (frame.s1 + 2.0 * frame.s2 * r2);
                let py = 2.0 * (frame.s3 + 2.0 * frame.s4 * r2);
                ex += r2 * (frame.s1 + frame.s2 * r2);
                ey += r2 * (frame.s3 + frame.s4 * r2);
                a += px * x;
                b += px * y;
                c += py * x;
                d += py * y;
            }
            det = a * d - b * c;
            x -= (d * ex - b * ey) / det;
            y -= (a * ey - c * ex) / det;
        }
        let dx = (d * dxd - b * dyd) / det;
        let dy = (a * dyd - c * dxd) / det;
        let slope = frame.normal_x * x + (frame.normal_y * y + frame.normal_z);
        let z = frame.offset / slope;
        let there = det > 0.0 && a + d > 0.0 && abs(x) < 1e9 && abs(y) < 1e9 && slope > 1e-6 && z < 1e6;
        // dx and dy come from the ray, dz from the plane.
        let dz = -z * (frame.normal_x * dx + frame.normal_y * dy) / slope;
        let mx = dz * x + z * dx;
        let my = dz * y + z * dy;
        let sigma = sqrt(mx * mx + (my * my + dz * dz)) * k.sigma_px;
        let p = vec3(x * z, y * z, z);
        let spot = vec4(row(poses[3u * k.shot], p), row(poses[3u * k.shot + 1u], p), row(poses[3u * k.shot + 2u],
            p), sigma);
        // The first reason is kept.
        let alone = k.flags & REASON;
        let compared = select(alone, beside(k), alone == 0u);
        let why = select(compared, NO_POINT, compared == 0u && !there);
        points[id.x] = select(vec4(bitcast<f32>(frame.none)), spot, why == 0u);
        peaks[id.x].flags = k.flags | why;
    }
}
