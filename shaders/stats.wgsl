// In: pictures. Out: per block of 16 x 8 pixels its sum, its largest and smallest pixel, and its smallest sums of a
// row, of a column and of a quad (2 x 2 pixels). From these `tiles` proves that a block contains no lit pixel. This is
// the only pass that reads every pixel: 16 pixels per load, four pixels per addition. Values of deeper pictures are in
// 256ths of their full scale, rounded to the safe side: the largest up, all others down.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<vec4<u32>>;
// (sum | largest << 15 | smallest << 24, smallest row sum | smallest column sum << 12 | half the smallest quad << 23)
@group(0) @binding(2) var<storage, read_write> stats: array<vec2<u32>>;

fn most(v: vec4<u32>) -> u32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}
fn least(v: vec4<u32>) -> u32 {
    return min(min(v.x, v.y), min(v.z, v.w));
}

fn block8(first: u32, top: u32) -> vec2<u32> {
    let low = vec4(0x00ff00ffu);
    let pitch = frame.pitch / 4u;
    var even = vec4(0u); // columns 0 and 2 of each word, 16 bits each
    var odd = vec4(0u); // columns 1 and 3
    var row_least = 0xffffffffu;
    // The top half or byte of the largest word is the largest of the top halves or bytes. The same holds for the
    // smallest.
    var quads = vec4(0xffffffffu);
    var m0 = vec4(0u);
    var m1 = vec4(0u);
    var m2 = vec4(0u);
    var m3 = vec4(0u);
    var n0 = vec4(0xffffffffu);
    var n1 = vec4(0xffffffffu);
    var n2 = vec4(0xffffffffu);
    var n3 = vec4(0xffffffffu);
    for (var r = 0u; r < 8u; r += 2u) {
        let va = image[first + min(top + r, frame.height - 1u) * pitch];
        let ea = va & low;
        let oa = (va >> vec4(8u)) & low;
        even += ea;
        odd += oa;
        let sa = ea + oa;
        let ta = (sa.x + sa.y) + (sa.z + sa.w);
        row_least = min(row_least, (ta & 0xffffu) + (ta >> 16u));
        m0 = max(m0, va);
        m1 = max(m1, va << vec4(8u));
        m2 = max(m2, va << vec4(16u));
        m3 = max(m3, va << vec4(24u));
        n0 = min(n0, va);
        n1 = min(n1, va << vec4(8u));
        n2 = min(n2, va << vec4(16u));
        n3 = min(n3, va << vec4(24u));
        let vb = image[first + min(top + r + 1u, frame.height - 1u) * pitch];
        let eb = vb & low;
        let ob = (vb >> vec4(8u)) & low;
        even += eb;
        odd += ob;
        let sb = eb + ob;
        let tb = (sb.x + sb.y) + (sb.z + sb.w);
        row_least = min(row_least, (tb & 0xffffu) + (tb >> 16u));
        m0 = max(m0, vb);
        m1 = max(m1, vb << vec4(8u));
        m2 = max(m2, vb << vec4(16u));
        m3 = max(m3, vb << vec4(24u));
        n0 = min(n0, vb);
        n1 = min(n1, vb << vec4(8u));
        n2 = min(n2, vb << vec4(16u));
        n3 = min(n3, vb << vec4(24u));
        let pairs = sa + sb;
        quads = min(quads, min(pairs, pairs << vec4(16u)));
    }
    let s = even + odd;
    let sum = (s & vec4(0xffffu)) + (s >> vec4(16u));
    let columns = min(min(even & vec4(0xffffu), even >> vec4(16u)), min(odd & vec4(0xffffu), odd >> vec4(16u)));
    let largest = most(max(max(m0, m1), max(m2, m3))) >> 24u;
    let smallest = least(min(min(n0, n1), min(n2, n3))) >> 24u;
    let quad = least(quads) >> 17u;
    return vec2(((sum.x + sum.y) + (sum.z + sum.w)) | (largest << 15u) | (smallest << 24u),
        row_least | (least(columns) << 12u) | (quad << 23u));
}

fn block16(first: u32, top: u32) -> vec2<u32> {
    let pitch = frame.pitch / 4u;
    var a = vec4(0u);
    var b = vec4(0u);
    var c = vec4(0u);
    var d = vec4(0u);
    var row_least = 0xffffffffu;
    var largest = vec4(0u);
    var smallest = vec4(0xffffu);
    var quads = vec4(0xffffffffu);
    var above_v = vec4(0u);
    var above_u = vec4(0u);
    for (var r = 0u; r < 8u; r++) {
        let at = first + min(top + r, frame.height - 1u) * pitch;
        let v = image[at];
        let u = image[at + 1u];
        let v0 = v & vec4(0xffffu);
        let v1 = v >> vec4(16u);
        let u0 = u & vec4(0xffffu);
        let u1 = u >> vec4(16u);
        a += v0;
        b += v1;
        c += u0;
        d += u1;
        let pairs_v = v0 + v1;
        let pairs_u = u0 + u1;
        // The first row of a pair is stored, the second completes the quads.
        let complete = vec4((r & 1u) == 1u);
        quads = min(quads, select(quads, min(above_v + pairs_v, above_u + pairs_u), complete));
        above_v = pairs_v;
        above_u = pairs_u;
        let s = pairs_v + pairs_u;
        row_least = min(row_least, (s.x + s.y) + (s.z + s.w));
        largest = max(largest, max(max(v0, v1), max(u0, u1)));
        smallest = min(smallest, min(min(v0, v1), min(u0, u1)));
    }
    let sum = (a + b) + (c + d);
    let total = (sum.x + sum.y) + (sum.z + sum.w);
    let column_least = least(min(min(a, b), min(c, d)));
    let deep = depth_shift();
    let largest8 = (most(largest) + (1u << deep) - 1u) >> deep;
    return vec2(
        (total >> deep) | (largest8 << 15u) | ((least(smallest) >> deep) << 24u),
        (row_least >> deep) | ((column_least >> deep) << 12u) | ((least(quads) >> (deep + 1u)) << 23u),
    );
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let blocks_x = 2u * frame.tiles_x;
    let blocks = blocks_x * frame.tiles_y * frame.shots;
    // Invocations beyond the end repeat the last block: cheaper than a branch.
    let i = min(id.x, blocks - 1u);
    let y = divide(i, blocks_x);
    let shot = divide(y, frame.tiles_y);
    let top = (y - shot * frame.tiles_y) * 8u;
    let x = i - y * blocks_x;
    let first = shot * (frame.shot_words / 4u);
    if px_log2 == 2u {
        stats[i] = block8(first + x, top);
    } else {
        stats[i] = block16(first + 2u * x, top);
    }
}
