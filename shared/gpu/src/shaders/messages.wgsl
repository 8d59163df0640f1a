// The tree: own scores and messages of the children, their transforms, the best root of every cell, and backtracking. There are only
// sums and comparisons, in the order of `fmp::Solver`, so that scores and poses have the same bits.
struct Level { rows: u32, cols: u32, area: u32, cell0: u32, feat0: u32, stride: u32, map0: u32, unused: u32 }
const PLANES: u32 = @PLANES@u;   // parts x types
const PARTS: u32 = @PARTS@u;
const REACH: i32 = @REACH@;      // longest offset in the tables of costs
const NOTHING: f32 = -4.0e30;    // used instead of minus infinity, which WGSL lacks
const LOWEST: f32 = -3.0e38;

@group(0) @binding(0) var<storage, read> levels: array<Level>;

// ---- own scores + messages of the children
@group(0) @binding(1) var<storage, read> c_blocks: array<vec2<u32>>;         // level, first of 512 cells
@group(0) @binding(2) var<storage, read> c_jobs: array<vec4<u32>>;           // part, number of children, first child
@group(0) @binding(3) var<storage, read> c_children: array<u32>;
@group(0) @binding(4) var<storage, read> c_bias: array<f32>;                 // [child][parent's type][type]
@group(0) @binding(5) var<storage, read> c_maps: array<f32>;
@group(0) @binding(6) var<storage, read> c_moved: array<f32>;
@group(0) @binding(7) var<storage, read_write> c_scores: array<f32>;
@group(0) @binding(8) var<storage, read_write> c_ranges: array<atomic<u32>>; // [level][plane][maximum, ~minimum, own maximum]

// Converts numbers to integers of the same order.
fn key(x: f32) -> u32 {
    let b = bitcast<u32>(x);
    return select(b | 0x80000000u, ~b, (b & 0x80000000u) != 0u);
}
fn number(k: u32) -> f32 {
    return bitcast<f32>(select(~k, k & 0x7fffffffu, (k & 0x80000000u) != 0u));
}

var<workgroup> highest: array<f32, @TYPES@ * 128>;
var<workgroup> lowest: array<f32, @TYPES@ * 128>;
var<workgroup> own_highest: array<f32, @TYPES@ * 128>;

@compute @workgroup_size(128, 1, 1)
fn combine(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = c_blocks[group.x];
    let job = c_jobs[group.y];
    let level = levels[block.x];
    let own = level.map0 + job.x * @TYPES@u * level.area;
    var high: array<f32, @TYPES@>;
    var low: array<f32, @TYPES@>;
    var own_high: array<f32, @TYPES@>;
    @unroll l 0 @TYPES@ 1 { high[$l] = LOWEST; low[$l] = 3.0e38; own_high[$l] = LOWEST; }
    @unroll e 0 4 1 {
        let at = block.y + $e * 128u + t;
        if (at < level.area) {
            var s: array<f32, @TYPES@>;
            @unroll l 0 @TYPES@ 1 {
                s[$l] = c_maps[own + $l * level.area + at];
                own_high[$l] = max(own_high[$l], s[$l]);
            }
            for (var c = 0u; c < job.y; c++) {
                let child = c_children[job.z + c];
                let from0 = level.map0 + child * @TYPES@u * level.area + at;
                var d: array<f32, @TYPES@>;
                @unroll k 0 @TYPES@ 1 { d[$k] = c_moved[from0 + $k * level.area]; }
                @unroll l 0 @TYPES@ 1 {
                    let b = (child * @TYPES@u + $l) * @TYPES@u;
                    var best = d[0] + c_bias[b];
                    @unroll k 1 @TYPES@ 1 { best = max(best, d[$k] + c_bias[b + $k]); }
                    s[$l] = s[$l] + best;
                }
            }
            @unroll l 0 @TYPES@ 1 {
                c_scores[own + $l * level.area + at] = s[$l];
                high[$l] = max(high[$l], s[$l]);
                low[$l] = min(low[$l], s[$l]);
            }
        }
    }
    @unroll l 0 @TYPES@ 1 {
        highest[$l * 128u + t] = high[$l];
        lowest[$l * 128u + t] = low[$l];
        own_highest[$l * 128u + t] = own_high[$l];
    }
    for (var step = 64u; step > 0u; step = step >> 1u) {
        workgroupBarrier();
        if (t < step) {
            @unroll l 0 @TYPES@ 1 {
                let a = $l * 128u + t;
                highest[a] = max(highest[a], highest[a + step]);
                lowest[a] = min(lowest[a], lowest[a + step]);
                own_highest[a] = max(own_highest[a], own_highest[a + step]);
            }
        }
    }
    workgroupBarrier();
    if (t < @TYPES@u) {
        let at = (block.x * PLANES + job.x * @TYPES@u + t) * 3u;
        atomicMax(&c_ranges[at], key(highest[t * 128u]));
        atomicMax(&c_ranges[at + 1u], ~key(lowest[t * 128u]));
        atomicMax(&c_ranges[at + 2u], key(own_highest[t * 128u]));
    }
}

// ---- transform of planes: down the columns, then along the rows, of 32 x 32 cells
@group(0) @binding(1) var<storage, read> d_tiles: array<vec4<u32>>;          // level, first row, first column
@group(0) @binding(2) var<storage, read> d_planes: array<u32>;
@group(0) @binding(3) var<storage, read> d_springs: array<vec4<f32>>;        // for each plane: stiffness and best offset, y and x
@group(0) @binding(4) var<storage, read> d_costs: array<f32>;                // [plane][y, x][offset + REACH: 2 REACH]
@group(0) @binding(5) var<storage, read> d_ranges: array<u32>;
@group(0) @binding(6) var<storage, read> d_scores: array<f32>;
@group(0) @binding(7) var<storage, read_write> d_moved: array<f32>;

fn spread(most: u32, least: u32) -> f32 {
    let high = number(most);
    let low = number(~least);
    return (high - low) + 1.0e-5 * (abs(high) + abs(low));
}
// First and last child that can be best for the parent at p: the same as on the CPU, or a few more.
fn reach(p: i32, n: i32, stiffness: f32, centre: f32, spread: f32) -> vec2<i32> {
    let c = f32(p) + centre;
    let nearest = clamp(floor(c + 0.5), 0.0, f32(n - 1));
    let away = nearest - c;
    let half = sqrt(spread / stiffness + away * away) * 1.00001 + 0.01;
    let first = clamp(ceil(c - half), 0.0, nearest);
    let last = clamp(floor(c + half), nearest, f32(n - 1));
    return vec2<i32>(i32(first), i32(last));
}

var<workgroup> tile_of: array<f32, 1056>; // [row 32][33]

@compute @workgroup_size(128, 1, 1)
fn transform(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let tile = d_tiles[group.x];
    let plane = d_planes[group.y];
    let level = levels[tile.x];
    let rows = i32(level.rows);
    let cols = i32(level.cols);
    let spring = d_springs[plane];
    let range = (tile.x * PLANES + plane) * 3u;
    let gap = spread(d_ranges[range], d_ranges[range + 1u]);
    let from0 = i32(level.map0 + plane * level.area);
    let cost_y = i32(plane) * 4 * REACH + REACH;
    let cost_x = cost_y + 2 * REACH;
    let lane = i32(t & 31u);
    let eight = i32(t >> 5u) * 8;
    let x0 = i32(tile.z);
    let y0 = i32(tile.y);
    let py = y0 + eight;
    let wy = vec2<i32>(reach(py, rows, spring.x, spring.y, gap).x, reach(min(py + 7, rows - 1), rows, spring.x, spring.y, gap).y);
    let px = x0 + eight;
    let wx = vec2<i32>(reach(min(px, cols - 1), cols, spring.z, spring.w, gap).x, reach(min(px + 7, cols - 1), cols, spring.z, spring.w, gap).y);
    let first_x = reach(x0, cols, spring.z, spring.w, gap).x;
    let last_x = reach(min(x0 + 31, cols - 1), cols, spring.z, spring.w, gap).y;
    var out: array<f32, 8>;
    @unroll j 0 8 1 { out[$j] = NOTHING; }
    for (var chunk = first_x; chunk <= last_x; chunk += 32) {
        let x = chunk + lane;
        var m: array<f32, 8>;
        @unroll j 0 8 1 { m[$j] = NOTHING; }
        if (x < cols && py < rows) {
            for (var v = wy.x; v <= wy.y; v += 8) {
                let o = cost_y + v - py - 7;
                var c: array<f32, 15>;
                @unroll i 0 15 1 { c[$i] = d_costs[o + $i]; }
                @unroll i 0 8 1 {
                    let s = select(NOTHING, d_scores[from0 + min(v + $i, rows - 1) * cols + x], v + $i < rows);
                    @unroll j 0 8 1 { m[$j] = max(m[$j], s + c[7 + $i - $j]); }
                }
            }
        }
        workgroupBarrier();
        @unroll j 0 8 1 { tile_of[(eight + $j) * 33 + lane] = m[$j]; }
        workgroupBarrier();
        if (px < cols) {
            @unroll b 0 32 8 {
                let v = chunk + $b;
                if (v + 7 >= wx.x && v <= wx.y) {
                    let o = cost_x + v - px - 7;
                    var c: array<f32, 15>;
                    @unroll i 0 15 1 { c[$i] = d_costs[o + $i]; }
                    @unroll i 0 8 1 {
                        let s = tile_of[lane * 33 + $b + $i];
                        @unroll j 0 8 1 { out[$j] = max(out[$j], s + c[7 + $i - $j]); }
                    }
                }
            }
        }
    }
    // Transposed in shared memory, so that a store writes a row.
    workgroupBarrier();
    @unroll j 0 8 1 { tile_of[lane * 33 + eight + $j] = out[$j]; }
    workgroupBarrier();
    if (x0 + lane < cols) {
        @unroll j 0 8 1 {
            if (py + $j < rows) { d_moved[from0 + (py + $j) * cols + x0 + lane] = tile_of[(eight + $j) * 33 + lane]; }
        }
    }
}

// ---- score and type of the best root of every cell
@group(0) @binding(1) var<storage, read> r_level_of_cell: array<u32>;
@group(0) @binding(2) var<storage, read> r_bias: array<f32>;
@group(0) @binding(3) var<storage, read> r_scores: array<f32>;
@group(0) @binding(4) var<storage, read_write> r_roots: array<vec2<u32>>;

@compute @workgroup_size(128, 1, 1)
fn roots(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let cell = group.x * 128u + t;
    if (cell >= arrayLength(&r_level_of_cell)) { return; }
    let level = levels[r_level_of_cell[cell]];
    let at = level.map0 + cell - level.cell0;
    var best = r_scores[at] + r_bias[0];
    var kind = 0u;
    for (var l = 1u; l < @TYPES@u; l++) {
        let s = r_scores[at + l * level.area] + r_bias[0];
        if (s > best) { best = s; kind = l; }
    }
    r_roots[cell] = vec2<u32>(bitcast<u32>(best), kind);
}

// ---- roots with no better neighbour among the eight around them, and no equal one before them; other roots get type 255
@group(0) @binding(1) var<storage, read> p_level_of_cell: array<u32>;
@group(0) @binding(2) var<storage, read> p_roots: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> p_peaks: array<vec2<u32>>;

@compute @workgroup_size(128, 1, 1)
fn peaks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let cell = group.x * 128u + t;
    if (cell >= arrayLength(&p_level_of_cell)) { return; }
    let level = levels[p_level_of_cell[cell]];
    let y = i32((cell - level.cell0) / level.cols);
    let x = i32((cell - level.cell0) % level.cols);
    let own = bitcast<f32>(p_roots[cell].x);
    var kind = p_roots[cell].y;
    for (var v = max(y - 1, 0); v <= min(y + 1, i32(level.rows) - 1); v++) {
        for (var u = max(x - 1, 0); u <= min(x + 1, i32(level.cols) - 1); u++) {
            let other = bitcast<f32>(p_roots[level.cell0 + u32(v) * level.cols + u32(u)].x);
            let is_before = v < y || (v == y && u < x);
            if (other > own || (other == own && is_before)) { kind = 255u; }
        }
    }
    p_peaks[cell] = vec2<u32>(p_roots[cell].x, kind);
}

// ---- backtracking, one workgroup per root: @SLOTS@ parts of equal depth together, 32 threads for each type of each part
@group(0) @binding(1) var<storage, read> t_level_of_cell: array<u32>;
@group(0) @binding(2) var<storage, read> t_roots: array<u32>;                // cell x 8 + type
@group(0) @binding(3) var<storage, read> t_parents: array<u32>;
@group(0) @binding(4) var<storage, read> t_bias: array<f32>;
@group(0) @binding(5) var<storage, read> t_costs: array<f32>;
@group(0) @binding(6) var<storage, read> t_scores: array<f32>;
@group(0) @binding(7) var<storage, read> t_ranges: array<u32>;
@group(0) @binding(8) var<storage, read> t_springs: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> t_groups: array<vec4<u32>>;         // parts of equal depth; 0: none
@group(0) @binding(10) var<storage, read_write> t_poses: array<u32>;         // [root][part][x, y, type]

const THREADS: u32 = @TYPES@u * 32u * @SLOTS@u;
var<workgroup> part_x: array<u32, 64>;
var<workgroup> part_y: array<u32, 64>;
var<workgroup> part_type: array<u32, 64>;
var<workgroup> best_score: array<f32, THREADS>;
var<workgroup> best_place: array<u32, THREADS>;

@compute @workgroup_size(THREADS, 1, 1)
fn trace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let root = t_roots[group.x];
    let cell = root >> 3u;
    let level_at = t_level_of_cell[cell];
    let level = levels[level_at];
    let pose0 = group.x * PARTS * 3u;
    if (t == 0u) {
        let place = cell - level.cell0;
        part_y[0] = place / level.cols;
        part_x[0] = place % level.cols;
        part_type[0] = root & 7u;
        t_poses[pose0] = part_x[0];
        t_poses[pose0 + 1u] = part_y[0];
        t_poses[pose0 + 2u] = part_type[0];
    }
    workgroupBarrier();
    let rows = i32(level.rows);
    let cols = i32(level.cols);
    let slot = t / (@TYPES@u * 32u);
    let k = (t / 32u) % @TYPES@u;
    let lane = i32(t % 32u);
    let n_groups = arrayLength(&t_groups);
    for (var g = 0u; g < n_groups; g++) {
        let part = t_groups[g][slot];
        let up = t_parents[part];
        var score = LOWEST;
        var place = 0u;
        if (part != 0u) {
            let yp = i32(part_y[up]);
            let xp = i32(part_x[up]);
            let plane = part * @TYPES@u + k;
            let range = (level_at * PLANES + plane) * 3u;
            let gap = spread(t_ranges[range], t_ranges[range + 1u]);
            let spring = t_springs[plane];
            let wy = reach(yp, rows, spring.x, spring.y, gap);
            let wx = reach(xp, cols, spring.z, spring.w, gap);
            let from0 = i32(level.map0 + plane * level.area);
            let cost_y = i32(plane) * 4 * REACH + REACH;
            let cost_x = cost_y + 2 * REACH;
            for (var x = wx.x + lane; x <= wx.y; x += 32) {
                var column = LOWEST;
                var row = 0;
                for (var y0 = wy.x; y0 <= wy.y; y0 += 4) {
                    @unroll i 0 4 1 {
                        let y = y0 + $i;
                        let s = t_scores[from0 + min(y, rows - 1) * cols + x] + t_costs[cost_y + y - yp];
                        if (y <= wy.y && s > column) { column = s; row = y; }
                    }
                }
                let s = column + t_costs[cost_x + x - xp];
                if (s > score) { score = s; place = (u32(x) << 16u) | u32(row); }
            }
        }
        best_score[t] = score;
        best_place[t] = place;
        for (var step = 16; step > 0; step = step >> 1u) {
            workgroupBarrier();
            if (lane < step) {
                let s = best_score[t + u32(step)];
                let p = best_place[t + u32(step)];
                if (s > best_score[t] || (s == best_score[t] && (p >> 16u) < (best_place[t] >> 16u))) {
                    best_score[t] = s;
                    best_place[t] = p;
                }
            }
        }
        workgroupBarrier();
        if (t % (@TYPES@u * 32u) == 0u && part != 0u) {
            let l = part_type[up];
            var most = LOWEST;
            var kind = 0u;
            for (var i = 0u; i < @TYPES@u; i++) {
                let s = best_score[t + i * 32u] + t_bias[(part * @TYPES@u + l) * @TYPES@u + i];
                if (s > most) { most = s; kind = i; }
            }
            let found = best_place[t + kind * 32u];
            part_x[part] = found >> 16u;
            part_y[part] = found & 0xffffu;
            part_type[part] = kind;
            let at = pose0 + part * 3u;
            t_poses[at] = part_x[part];
            t_poses[at + 1u] = part_y[part];
            t_poses[at + 2u] = kind;
        }
        workgroupBarrier();
    }
}
