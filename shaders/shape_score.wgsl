// In: responses and, for every turn, the place where each feature of the model reads them. Out: the sum over the
// features at every strided place, one byte per place. There are at most 63 features of 4 each, so that bytes added as
// words never carry. Frame and unit: strided cells; a perfect feature scores 4.
@group(0) @binding(0) var<uniform> frame: ShapeFrame;
@group(0) @binding(1) var<storage, read> responses: array<u32>;
// x: first word of the direction and phase; then the shift in columns and in rows.
@group(0) @binding(2) var<storage, read> features: array<vec4<i32>>;
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;

// Ones in the bytes from `low` to `high` - 1; both are 0 to 4.
fn bytes(low: u32, high: u32) -> u32 {
    let below = select((1u << (8u * min(high, 3u))) - 1u, 0xffffffffu, high > 3u);
    return below & ~select((1u << (8u * min(low, 3u))) - 1u, 0xffffffffu, low > 3u);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let plane = frame.words * frame.rows;
    if id.x < plane {
        let row = i32(id.x / frame.words);
        let column = i32(id.x % frame.words) * 4;
        let words = i32(frame.words);
        var sum = 0u;
        for (var f = 0u; f < frame.features; f++) {
            let feature = features[id.y * frame.features + f];
            let y = row + feature.z;
            let x = column + feature.y;
            // Four bytes from any place: they come from the two words that contain them, and only those inside the row
            // count.
            let word = x >> 2u;
            let start = feature.x + clamp(y, 0, i32(frame.rows) - 1) * words;
            let left = responses[start + clamp(word, 0, words - 1)];
            let right = responses[start + clamp(word + 1, 0, words - 1)];
            let shift = 8u * (u32(x) & 3u);
            let four = (left >> shift) | select(right << (32u - shift), 0u, shift == 0u);
            let low = u32(clamp(-x, 0, 4));
            let high = u32(clamp(4 * words - x, 0, 4));
            let there = y >= 0 && y < i32(frame.rows) && low < high;
            sum += select(0u, four & bytes(low, high), there);
        }
        sums[id.y * plane + id.x] = sum;
    }
}
