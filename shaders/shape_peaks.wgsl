// In: sums of every turn. Out: the places whose sum reaches the least sum and is not exceeded by a neighbour of the
// same turn, in the order in which the GPU ran. Turn and sum are in one word, column and row in the next. Frame and
// unit: strided cells.
@group(0) @binding(0) var<uniform> frame: ShapeFrame;
@group(0) @binding(1) var<storage, read> sums: array<u32>;
// Word 3: number of places found; the first `capacity` of them are in the list.
@group(0) @binding(2) var<storage, read_write> header: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> hits: array<vec2<u32>>;

fn at(first: u32, x: i32, y: i32) -> u32 {
    let inside = x >= 0 && y >= 0 && x < i32(frame.columns) && y < i32(frame.rows);
    let cell = vec2<u32>(u32(clamp(x, 0, i32(frame.columns) - 1)), u32(clamp(y, 0, i32(frame.rows) - 1)));
    let word = sums[first + cell.y * frame.words + cell.x / 4u];
    return select(0u, (word >> (8u * (cell.x % 4u))) & 255u, inside);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let plane = frame.words * frame.rows;
    let first = id.y * plane;
    if id.x < plane {
        let row = id.x / frame.words;
        let column = id.x % frame.words * 4u;
        let word = sums[first + id.x];
        for (var k = 0u; k < 4u; k++) {
            let x = i32(column + k);
            let y = i32(row);
            let value = (word >> (8u * k)) & 255u;
            if value >= frame.least && column + k < frame.columns {
                var highest = 0u;
                for (var dy = -1; dy <= 1; dy++) {
                    for (var dx = -1; dx <= 1; dx++) {
                        highest = max(highest, at(first, x + dx, y + dy));
                    }
                }
                if highest <= value {
                    let place = atomicAdd(&header[COUNT], 1u);
                    if place < frame.capacity {
                        hits[place] = vec2<u32>(id.y | (value << 24u), (column + k) | (row << 16u));
                    }
                }
            }
        }
    }
}
