// Responses of the filters: for every cell and filter, the sum over rows, columns and channels, with one fused operation per term, in
// the order of `Extractor::direct`. A workgroup computes 64 cells by 160 planes, 8 by 10 per thread. It loads 16 channels at a time
// into shared memory, and fetches the next channels meanwhile.
struct Level { rows: u32, cols: u32, area: u32, cell0: u32, feat0: u32, stride: u32, map0: u32, unused: u32 }
const SIDE: u32 = @SIDE@u;      // side of a filter, in cells
const PLANES: u32 = @PLANES@u;  // parts x types

@group(0) @binding(0) var<storage, read> levels: array<Level>;
@group(0) @binding(1) var<storage, read> level_of_cell: array<u32>;
@group(0) @binding(2) var<storage, read> features: array<vec4<f32>>;       // [row][col][channel / 4]
@group(0) @binding(3) var<storage, read> weights: array<vec4<f32>>;        // [block of 160 planes][tap][channel / 4][160]
@group(0) @binding(4) var<storage, read_write> maps: array<f32>;           // [level][plane][row][col]

const CELLS: u32 = 64u;
const STRIDE: u32 = 66u;
var<workgroup> cells: array<vec4<f32>, 264>;     // [channel / 4: 4][66]
var<workgroup> filters: array<vec4<f32>, 640>;   // [channel / 4: 4][160]

@compute @workgroup_size(128, 1, 1)
fn responses(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let n_cells = arrayLength(&level_of_cell);
    // The two vectors of features that this thread fetches.
    var base: array<u32, 2>;
    var stride: array<u32, 2>;
    @unroll e 0 2 1 {
        let m = min((t + $e * 128u) >> 2u, CELLS - 1u);
        let cell = min(group.x * CELLS + m, n_cells - 1u);
        let level = levels[level_of_cell[cell]];
        let place = cell - level.cell0;
        let y = place / level.cols;
        let x = place - y * level.cols;
        base[$e] = (level.feat0 + y * level.stride + x) * 8u + (t & 3u);
        stride[$e] = level.stride * 8u;
    }
    let row = t & 7u;
    let col = t >> 3u;
    var sum: array<array<f32, 10>, 8>;
    @unroll i 0 8 1 { @unroll j 0 10 1 { sum[$i][$j] = 0.0; } }
    let n_steps = SIDE * SIDE * 2u;
    let weights0 = group.y * n_steps * 640u + t;
    var a0 = features[base[0]];
    var a1 = features[base[1]];
    var b0 = weights[weights0];
    var b1 = weights[weights0 + 128u];
    var b2 = weights[weights0 + 256u];
    var b3 = weights[weights0 + 384u];
    var b4 = weights[weights0 + 512u];
    for (var step = 0u; step < n_steps; step++) {
        workgroupBarrier();
        cells[(t & 3u) * STRIDE + (t >> 2u)] = a0;
        cells[(t & 3u) * STRIDE + ((t + 128u) >> 2u)] = a1;
        filters[t] = b0;
        filters[t + 128u] = b1;
        filters[t + 256u] = b2;
        filters[t + 384u] = b3;
        filters[t + 512u] = b4;
        workgroupBarrier();
        let next = min(step + 1u, n_steps - 1u);
        let tap = next >> 1u;
        let tap_y = tap / SIDE;
        let offset = (tap - tap_y * SIDE) * 8u + (next & 1u) * 4u;
        a0 = features[base[0] + tap_y * stride[0] + offset];
        a1 = features[base[1] + tap_y * stride[1] + offset];
        let at = weights0 + next * 640u;
        b0 = weights[at];
        b1 = weights[at + 128u];
        b2 = weights[at + 256u];
        b3 = weights[at + 384u];
        b4 = weights[at + 512u];
        @unroll q 0 4 1 {
            var a: array<vec4<f32>, 8>;
            @unroll i 0 8 1 { a[$i] = cells[$q * STRIDE + row + 8u * $i]; }
            @unroll j 0 10 1 {
                let b = filters[$q * 160u + col + 16u * $j];
                @unroll i 0 8 1 {
                    sum[$i][$j] = fma(a[$i].x, b.x, sum[$i][$j]);
                    sum[$i][$j] = fma(a[$i].y, b.y, sum[$i][$j]);
                    sum[$i][$j] = fma(a[$i].z, b.z, sum[$i][$j]);
                    sum[$i][$j] = fma(a[$i].w, b.w, sum[$i][$j]);
                }
            }
        }
    }
    @unroll i 0 8 1 {
        let cell = group.x * CELLS + row + 8u * $i;
        if (cell < n_cells) {
            let level = levels[level_of_cell[cell]];
            let at = level.map0 + cell - level.cell0;
            @unroll j 0 10 1 {
                let plane = group.y * 160u + col + 16u * $j;
                if (plane < PLANES) { maps[at + plane * level.area] = sum[$i][$j]; }
            }
        }
    }
}
