// The block of the stages grid_span, grid_sum and grid_pick, and the computation of a point's cell: only with whole
// numbers, so that every machine fills the same cells. The fields are explained at the struct of the same name in
// src/stages/grid.rs.
struct GridFrame {
    width: u32,
    height: u32,
    layer_steps: i32,
    points: u32,
    least_quality: i32,
    origin_x: i32,
    origin_y: i32,
    origin_z: i32,
    xx: i32,
    xy: i32,
    xz: i32,
    yx: i32,
    yy: i32,
    yz: i32,
    zx: i32,
    zy: i32,
    zz: i32,
    shift_x: u32,
    shift_y: u32,
    shift_z: u32,
    add_x_low: u32,
    add_x_high: u32,
    add_y_low: u32,
    add_y_high: u32,
    add_z_low: u32,
    add_z_high: u32,
    intensity_places: i32,
    reserved: u32,
}

// Words of one point in the cloud; the largest fixed-point magnitude; the largest height.
const RECORD = 9u;
const BEYOND = 0x20000000;
const Z_MOST = 32767;

// The bits of an f32 as a multiple of 2^-places, rounded. A number that is too large, and NaN, give BEYOND.
fn fixed(bits: u32, places: i32) -> i32 {
    let exponent = i32((bits >> 23u) & 255u);
    let mantissa = (bits & 0x7fffffu) | 0x800000u;
    let s = exponent - 150 + places;
    let t = u32(clamp(-s, 1, 26));
    let small = (mantissa + (1u << (t - 1u))) >> t;
    let large = mantissa << u32(clamp(s, 0, 5));
    let size = select(i32(select(small, large, s >= 0)), BEYOND, s > 5 || exponent == 255);
    let value = select(size, 0, exponent == 0);
    return select(value, -value, bits >> 31u == 1u);
}

// Product as a 64-bit two's complement (low, high).
fn product(a: i32, b: i32) -> vec2<u32> {
    let x = u32(abs(a));
    let y = u32(abs(b));
    let ll = (x & 0xffffu) * (y & 0xffffu);
    let lh = (x & 0xffffu) * (y >> 16u);
    let hl = (x >> 16u) * (y & 0xffffu);
    let middle = (ll >> 16u) + (lh & 0xffffu) + (hl & 0xffffu);
    let low = (ll & 0xffffu) | (middle << 16u);
    let high = (x >> 16u) * (y >> 16u) + (lh >> 16u) + (hl >> 16u) + (middle >> 16u);
    let negative = (a < 0) != (b < 0);
    return select(vec2(low, high), vec2(~low + 1u, ~high + u32(low == 0u)), negative);
}

fn plus(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2(low, a.y + b.y + u32(low < a.x));
}

// Floor of v / 2^s, s in 1..=62, if it fits 32 bits.
fn shifted(v: vec2<u32>, s: u32) -> i32 {
    let low = bitcast<i32>((v.y << ((32u - s) & 31u)) | (v.x >> (s & 31u)));
    return select(low, bitcast<i32>(v.y) >> ((s - 32u) & 31u), s >= 32u);
}

fn coordinate(d: vec3<i32>, row: vec3<i32>, add: vec2<u32>, shift: u32) -> i32 {
    return shifted(plus(plus(product(d.x, row.x), product(d.y, row.y)), plus(product(d.z, row.z), add)), shift);
}

// Index of the cell, and height + Z_MOST + 1; the second is 0 outside the grid.
fn place(f: GridFrame, p: vec3<u32>, quality: i32) -> vec2<u32> {
    let q = vec3(fixed(p.x, 14), fixed(p.y, 14), fixed(p.z, 14));
    let d = q - vec3(f.origin_x, f.origin_y, f.origin_z);
    let x = coordinate(d, vec3(f.xx, f.xy, f.xz), vec2(f.add_x_low, f.add_x_high), f.shift_x);
    let y = coordinate(d, vec3(f.yx, f.yy, f.yz), vec2(f.add_y_low, f.add_y_high), f.shift_y);
    let z = coordinate(d, vec3(f.zx, f.zy, f.zz), vec2(f.add_z_low, f.add_z_high), f.shift_z);
    let near = all(abs(q) < vec3(BEYOND)) && all(abs(d) < vec3(BEYOND));
    let inside = x >= 0 && y >= 0 && x < i32(f.width) && y < i32(f.height) && abs(z) <= Z_MOST;
    let good = quality >= f.least_quality && quality <= 0x7f800000;
    return select(vec2(0u), vec2(u32(y) * f.width + u32(x), u32(z + Z_MOST + 1)), near && inside && good);
}
