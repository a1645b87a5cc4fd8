// In: a picture, a skeleton pixel. Out: the unit vector across the stripe there. Twin and reasons:
// src/stages/peak/across/direction.rs; docs/math.md, Stripe peak (1). Frame and unit: pixels.

// Most directions computed in turn beside a border.
const BORDER_STEPS = 2u;
// A stripe counts as leaving the picture if at least this share of its direction points out of it.
const LEAVES = 0.3;

fn whole(x: i32, y: i32) -> i32 {
    let a = u32(clamp(x, 0, frame.width - 1));
    let b = u32(clamp(y, 0, frame.height - 1));
    let bits = 32u >> px_log2;
    let place = a & ((1u << px_log2) - 1u);
    return i32((image[first + b * frame.pitch + (a >> px_log2)] >> (place * bits)) & ((1u << bits) - 1u));
}

fn level(x: i32, y: i32) -> f32 {
    return f32(whole(x, y));
}

// Weights (1 - r^2 / 16)^2 in 64ths of the gradients one step away along both axes; two steps along one; two along
// both; at the pixel.
const ONE = 49;
const TWO = 36;
const FAR = 16;
const NONE = 64;

// Weight of the rig's direction against that of the gradients. It is multiplied by the square, minus 1, of how much
// worse the gradients agree than on a straight stripe.
const DISUNITED = 0.04;

// The structure tensor from 13 gradients on 24 grey levels, at every other place of a lattice, in whole numbers.
// Returns half the difference of its diagonal, the other element, half the difference of its eigenvalues and half their
// sum.
fn tensor(x: i32, y: i32, u: i32, v: i32) -> vec4<f32> {
    let a = vec3(whole(x - 2 * u, y - 3 * v), whole(x, y - 3 * v), whole(x + 2 * u, y - 3 * v));
    let b = vec4(whole(x - 3 * u, y - 2 * v), whole(x - u, y - 2 * v), whole(x + u, y - 2 * v), whole(x + 3 * u,
        y - 2 * v));
    let c = vec3(whole(x - 2 * u, y - v), whole(x, y - v), whole(x + 2 * u, y - v));
    let d = vec4(whole(x - 3 * u, y), whole(x - u, y), whole(x + u, y), whole(x + 3 * u, y));
    let e = vec3(whole(x - 2 * u, y + v), whole(x, y + v), whole(x + 2 * u, y + v));
    let f = vec4(whole(x - 3 * u, y + 2 * v), whole(x - u, y + 2 * v), whole(x + u, y + 2 * v), whole(x + 3 * u, y
        + 2 * v));
    let g = vec3(whole(x - 2 * u, y + 3 * v), whole(x, y + 3 * v), whole(x + 2 * u, y + 3 * v));
    // Ten bits per gradient.
    let deep = max(countOneBits(u32(frame.full_scale)), 10u) - 10u;
    let half = vec4(i32((1u << deep) >> 1u));
    let by = vec4(deep);
    // Gradients in the row two above, in the pixel's row and in the row two below; then the diagonals.
    let ax = ((b.yzw - b.xyz) + half.xyz) >> by.xyz;
    let ay = ((c - a) + half.xyz) >> by.xyz;
    let rx = ((d.yzw - d.xyz) + half.xyz) >> by.xyz;
    let ry = ((e - c) + half.xyz) >> by.xyz;
    let bx = ((f.yzw - f.xyz) + half.xyz) >> by.xyz;
    let wy = ((g - e) + half.xyz) >> by.xyz;
    let dx = (vec4(c.yz - c.xy, e.yz - e.xy) + half) >> by;
    let dy = (vec4(d.yz - b.yz, f.yz - d.yz) + half) >> by;
    let far = vec3(FAR, TWO, FAR);
    let row = vec3(TWO, NONE, TWO);
    let sxx = (dot(far, ax * ax) + dot(far, bx * bx)) + (dot(row, rx * rx) + ONE * dot(dx, dx));
    let sxy = (dot(far, ax * ay) + dot(far, bx * wy)) + (dot(row, rx * ry) + ONE * dot(dx, dy));
    let syy = (dot(far, ay * ay) + dot(far, wy * wy)) + (dot(row, ry * ry) + ONE * dot(dy, dy));
    let ratio = f32(v) / f32(u);
    let xx = (ratio * ratio) * f32(sxx);
    let yy = f32(syy);
    let h = 0.5 * (xx - yy);
    let xy = ratio * f32(sxy);
    return vec4(h, xy, sqrt(h * h + xy * xy), 0.5 * (xx + yy));
}

// Sine and cosine of twice the angle of a tensor's direction.
fn twice(t: vec4<f32>) -> vec2<f32> {
    return vec2(t.y, -t.x) / vec2(max(t.z, 1e-12));
}

// Sum of c sin(k a), k = 2, 4, 6, 8.
fn turn_of(sc: vec2<f32>, c: vec4<f32>) -> f32 {
    let s4 = 2.0 * sc.x * sc.y;
    let c4 = sc.y * sc.y - sc.x * sc.x;
    return c.x * sc.x + (c.y * s4 + (c.z * (s4 * sc.y + c4 * sc.x) + c.w * (2.0 * (s4 * c4))));
}

// Direction across the stripe. Corrects the error that differences over this distance make in the direction.
fn direction_at(x: i32, y: i32) -> vec2<f32> {
    var t = tensor(x, y, frame.lattice_u, frame.lattice_v);
    let seen = twice(t);
    var turn = turn_of(seen, vec4(frame.turn_2, frame.turn_4, frame.turn_6, frame.turn_8));
    // On a steep stripe the longer differences would span its whole width.
    if select(-seen.y, seen.y, frame.lattice_u > frame.lattice_v) < frame.flat {
        let side = min(frame.lattice_u, frame.lattice_v);
        t = tensor(x, y, side, side);
        turn = turn_of(twice(t), vec4(0.0, frame.square_4, 0.0, frame.square_8));
    }
    let h = t.x;
    let xy = t.y;
    let q = t.z;
    let m = select(vec2(xy, q - h), vec2(h + q, xy), h > 0.0);
    let n = vec2(m.x + turn * m.y, m.y - turn * m.x);
    // The direction at twice its angle: that of the gradients plus that of the rig, which has more weight the less the
    // gradients agree.
    let other = (t.w - q) / (frame.ragged * (t.w + q) + frame.restless);
    let own = 2.0 * q / (t.w + q);
    let length2 = n.x * n.x + n.y * n.y;
    let own2 = vec2(2.0 * n.x * n.y, n.y * n.y - n.x * n.x) / vec2(length2);
    let across = vec2(frame.across_u, frame.across_v);
    let rig2 = vec2(2.0 * across.x * across.y, across.y * across.y - across.x * across.x);
    // The rig's weight falls if the stripe is more than 45 degrees off the rig's direction, to 0 at 90: no edge causes
    // that.
    let near = min(1.0 + (own2.x * rig2.x + own2.y * rig2.y), 1.0);
    let rig = DISUNITED * max(other * other - 1.0, 0.0) * near;
    let sine = own * own2.x + rig * rig2.x;
    let cosine = own * own2.y + rig * rig2.y;
    let both = sqrt(sine * sine + cosine * cosine);
    let told = select(vec2(both - cosine, sine), vec2(sine, cosine + both), cosine > 0.0);
    let length = sqrt(told.x * told.x + told.y * told.y);
    let sign = select(1.0, -1.0, told.y < 0.0);
    let dark = sqrt(m.x * m.x + m.y * m.y) < 1e-9;
    return select(vec2(sign * told.x / length, sign * told.y / length), vec2(0.0, 1.0), dark);
}

// The next place along the stripe whose differences lie in the picture.
fn inward(x: i32, y: i32, n: vec2<f32>) -> vec2<i32> {
    let reach = 3 * max(frame.lattice_u, frame.lattice_v);
    let du = max(min(x, frame.width - 1 - reach), reach) - x;
    let dv = max(min(y, frame.height - 1 - reach), reach) - y;
    let t = vec2(n.y, -n.x);
    let by_u = select(0.0, f32(du) / t.x, abs(t.x) >= LEAVES);
    let by_v = select(0.0, f32(dv) / t.y, abs(t.y) >= LEAVES);
    let along = select(by_v, by_u, abs(by_u) >= abs(by_v));
    // Not 0.5, so that rounding errors do not decide.
    return vec2(x + i32(floor(along * t.x + 0.47)), y + i32(floor(along * t.y + 0.47)));
}

// Direction across the stripe. Beside the picture's border it is that of the stripe's next piece whose differences lie
// in the picture.
fn direction(x: i32, y: i32) -> vec2<f32> {
    var n = direction_at(x, y);
    for (var i = 0u; i < BORDER_STEPS; i++) {
        let inner = inward(x, y, n);
        if all(inner == vec2(x, y)) {
            break;
        }
        n = direction_at(inner.x, inner.y);
    }
    return n;
}
