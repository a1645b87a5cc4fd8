// Sums over columns of pixels; rows are added with four words per load. Needs `frame`, `image` as vectors of four
// words, and `px_log2`.

// Pixels in four words.
fn per_load() -> u32 {
    return 4u << px_log2;
}

// Two vectors per load: the sums of its even and of its odd columns. In 8-bit pictures each word holds two sums of 16
// bits: 101 * 255 fits. At most 18 loads: 16 bits and a radius of 50.
var<private> sums: array<vec4<u32>, 36>;

fn low() -> u32 {
    return select(0x0000ffffu, 0x00ff00ffu, px_log2 == 2u);
}
fn half() -> u32 {
    return select(16u, 8u, px_log2 == 2u);
}

// Four words of a row; beyond the row the border pixel repeats.
fn four(row: u32, i: i32) -> vec4<u32> {
    let last = i32(frame.pitch / 4u) - 1;
    let v = image[row + u32(clamp(i, 0, last))];
    let bits = 32u >> px_log2;
    let ones = select(0x01010101u, 0x00010001u, px_log2 == 1u);
    let left = (v.x & ((1u << bits) - 1u)) * ones;
    let right = (v.w >> (32u - bits)) * ones;
    return select(select(v, vec4(left), i < 0), vec4(right), i > last);
}

// Sets the first `loads` sums to zero.
fn clear_sums(loads: u32) {
    for (var i = 0u; i < 2u * loads; i++) {
        sums[i] = vec4(0u);
    }
}

// Adds a row of pixels to the sums (sign 1) or subtracts it (sign -1).
fn pass_row(row: u32, first: i32, loads: u32, sign: u32) {
    for (var i = 0u; i < loads; i++) {
        let v = four(row, first + i32(i));
        sums[2u * i] += (v & vec4(low())) * sign;
        sums[2u * i + 1u] += ((v >> vec4(half())) & vec4(low())) * sign;
    }
}

// All bits set for each column, counted from the first one loaded, that is one of `n` from `begin` on.
fn chosen(c: vec4<u32>, begin: u32, n: u32) -> vec4<u32> {
    return select(vec4(0u), vec4(0xffffffffu), c >= vec4(begin) & c < vec4(begin + n));
}

// Sum of those columns.
fn sum_of_columns(begin: u32, n: u32, loads: u32) -> u32 {
    var sum = vec4(0u);
    for (var i = 0u; i < loads; i++) {
        let c = vec4(i * per_load()) + vec4(0u, 1u, 2u, 3u) * vec4(1u << px_log2);
        let even = sums[2u * i];
        let odd = sums[2u * i + 1u];
        if px_log2 == 2u {
            sum += (even & vec4(0xffffu) & chosen(c, begin, n)) + ((even >> vec4(16u)) & chosen(c + vec4(2u), begin,
                n));
            sum += (odd & vec4(0xffffu) & chosen(c + vec4(1u), begin, n)) + ((odd >> vec4(16u)) & chosen(c
                + vec4(3u), begin, n));
        } else {
            sum += (even & chosen(c, begin, n)) + (odd & chosen(c + vec4(1u), begin, n));
        }
    }
    return (sum.x + sum.y) + (sum.z + sum.w);
}
