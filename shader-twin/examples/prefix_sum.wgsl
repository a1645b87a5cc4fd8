// In: whole numbers, a block of 64 for each workgroup. Out: the sums of each block from its begin on, and the block's
// sum. Unit: none.

struct Params {
    count: u32,
    // Added to the first number of each block.
    start: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> given: array<u32>;
@group(0) @binding(2) var<storage, read_write> sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> totals: array<u32>;

var<workgroup> shared_sums: array<u32, 64>;

@compute @workgroup_size(64)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3<u32>,
) {
    var own = 0u;
    if id.x < params.count {
        own = given[id.x];
    }
    if local == 0u {
        own += params.start;
    }
    shared_sums[local] = own;
    workgroupBarrier();
    for (var step = 1u; step < 64u; step <<= 1u) {
        var before = 0u;
        if local >= step {
            before = shared_sums[local - step];
        }
        workgroupBarrier();
        shared_sums[local] += before;
        workgroupBarrier();
    }
    if id.x < params.count {
        sums[id.x] = shared_sums[local];
    }
    if local == 63u {
        totals[group.x] = shared_sums[local];
    }
}
