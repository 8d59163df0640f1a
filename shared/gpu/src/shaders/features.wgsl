// From the image to the features of every level: shrinking, halving, gradients, histograms, energies, features. Every operation has the
// order and precision of the CPU's. No two operations may be fused.
struct Picture {
    w: u32, h: u32, pixel0: u32, source: u32,        // size; first pixel; picture from which it is halved
    rows: u32, cols: u32, cell0: u32, feature0: u32, // cells without padding; first cell; first padded cell
    pad_rows: u32, pad_cols: u32, padded_rows: u32, padded_cols: u32,
    table_x: u32, table_y: u32, taps_x: u32, taps_y: u32, // shrinking: first entry of an axis, samples per pixel
}
@group(0) @binding(0) var<storage, read> pictures: array<Picture>;
@group(0) @binding(1) var<storage, read> blocks: array<vec2<u32>>; // picture, first pixel or cell

// A driver's square root may be some units off. A Newton step in double rounds it to the nearest number.
fn nearest_sqrt(x: f32) -> f32 {
    let y = f64(sqrt(x));
    if (y == 0.0lf) { return 0.0; }
    return f32(0.5lf * (y + f64(x) / y));
}

// If one dimension cannot hold all blocks, they are split into rows.
fn block_of(group: vec3<u32>) -> u32 { return group.x + group.y * 32768u; }

@group(0) @binding(2) var<storage, read> s_image: array<u32>;    // bytes of the image
@group(0) @binding(3) var<storage, read> s_first: array<u32>;    // first sample of a pixel along an axis
@group(0) @binding(4) var<storage, read> s_weights: array<f64>;  // weights of 4 samples each
@group(0) @binding(5) var<storage, read> s_width: u32;
@group(0) @binding(6) var<storage, read_write> s_out: array<f64>; // [picture][channel][row][col]

fn byte_at(i: u32) -> f64 { return f64((s_image[i >> 2u] >> ((i & 3u) * 8u)) & 255u); }

@compute @workgroup_size(128)
fn shrink(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = block_of(group);
    if (at >= arrayLength(&blocks)) { return; }
    let p = pictures[blocks[at].x];
    let i = blocks[at].y + t;
    if (i >= p.w * p.h) { return; }
    let y = i / p.w;
    let x = i - y * p.w;
    let first_y = s_first[p.table_y + y];
    let first_x = s_first[p.table_x + x];
    var s0 = 0.0lf;
    var s1 = 0.0lf;
    var s2 = 0.0lf;
    for (var tx = 0u; tx < p.taps_x; tx++) {
        var c0 = 0.0lf;
        var c1 = 0.0lf;
        var c2 = 0.0lf;
        for (var ty = 0u; ty < p.taps_y; ty++) {
            let q = ((first_y + ty) * s_width + first_x + tx) * 3u;
            let w = s_weights[(p.table_y + y) * 4u + ty];
            c0 += w * byte_at(q);
            c1 += w * byte_at(q + 1u);
            c2 += w * byte_at(q + 2u);
        }
        let w = s_weights[(p.table_x + x) * 4u + tx];
        s0 += w * c0;
        s1 += w * c1;
        s2 += w * c2;
    }
    let n = p.w * p.h;
    let o = 3u * p.pixel0 + i;
    s_out[o] = s0;
    s_out[o + n] = s1;
    s_out[o + 2u * n] = s2;
}

@group(0) @binding(2) var<storage, read_write> h_image: array<f64>;
fn first_of(e: f64, s: f64, t: f64) -> f64 { return e * 0.6875lf + s * 0.25lf + t * 0.0625lf; }
fn inner(a: f64, b: f64, c: f64, d: f64, e: f64) -> f64 { return a * 0.0625lf + b * 0.25lf + c * 0.375lf + d * 0.25lf + e * 0.0625lf; }
fn folded(a: f64, b: f64, c: f64, last: f64) -> f64 { return last * 0.3125lf + c * 0.375lf + b * 0.25lf + a * 0.0625lf; }
fn border(at: u32, n_out: u32, n_in: u32) -> u32 {
    if (at == 0u) { return 0u; }
    if (at + 1u == n_out) { return 3u; }
    if (at + 2u == n_out && 2u * n_out > n_in) { return 2u; }
    return 1u;
}
fn down(at: u32, w: u32, by: u32) -> f64 {
    switch (by) {
        case 0u: { return first_of(h_image[at], h_image[at + w], h_image[at + 2u * w]); }
        case 3u: { return first_of(h_image[at], h_image[at - w], h_image[at - 2u * w]); }
        case 2u: { return folded(h_image[at - 2u * w], h_image[at - w], h_image[at], h_image[at + w]); }
        default: { return inner(h_image[at - 2u * w], h_image[at - w], h_image[at], h_image[at + w], h_image[at + 2u * w]); }
    }
}

@compute @workgroup_size(128)
fn halve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = block_of(group);
    if (block >= arrayLength(&blocks)) { return; }
    let p = pictures[blocks[block].x];
    let q = pictures[p.source];
    let i = blocks[block].y + t;
    if (i >= p.w * p.h) { return; }
    let y = i / p.w;
    let x = i - y * p.w;
    let by = border(y, p.h, q.h);
    let bx = border(x, p.w, q.w);
    for (var channel = 0u; channel < 3u; channel++) {
        let at = 3u * q.pixel0 + channel * q.w * q.h + 2u * y * q.w + 2u * x;
        var v = 0.0lf;
        switch (bx) {
            case 0u: { v = first_of(down(at, q.w, by), down(at + 1u, q.w, by), down(at + 2u, q.w, by)); }
            case 3u: { v = first_of(down(at, q.w, by), down(at - 1u, q.w, by), down(at - 2u, q.w, by)); }
            case 2u: { v = folded(down(at - 2u, q.w, by), down(at - 1u, q.w, by), down(at, q.w, by), down(at + 1u, q.w, by)); }
            default: { v = inner(down(at - 2u, q.w, by), down(at - 1u, q.w, by), down(at, q.w, by), down(at + 1u, q.w, by), down(at + 2u, q.w, by)); }
        }
        h_image[3u * p.pixel0 + channel * p.w * p.h + i] = v;
    }
}

@group(0) @binding(2) var<storage, read> g_image: array<f64>;
@group(0) @binding(3) var<storage, read_write> g_length: array<f32>;
@group(0) @binding(4) var<storage, read_write> g_bin: array<u32>;
const TO_X: array<f64, 9> = array<f64, 9>(1.0lf, 0.9397lf, 0.7660lf, 0.5lf, 0.1736lf, -0.1736lf, -0.5lf, -0.7660lf, -0.9397lf);
const TO_Y: array<f64, 9> = array<f64, 9>(0.0lf, 0.3420lf, 0.6428lf, 0.8660lf, 0.9848lf, 0.9848lf, 0.8660lf, 0.6428lf, 0.3420lf);

@compute @workgroup_size(128)
fn gradient(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = block_of(group);
    if (at >= arrayLength(&blocks)) { return; }
    let p = pictures[blocks[at].x];
    let i = blocks[at].y + t;
    if (i >= p.w * p.h) { return; }
    let y = i / p.w;
    let x = i - y * p.w;
    if (x == 0u || y == 0u || x + 1u >= p.w || y + 1u >= p.h) { return; }
    var square = -1.0lf;
    var dx = 0.0lf;
    var dy = 0.0lf;
    for (var channel = 0u; channel < 3u; channel++) {
        let r = 3u * p.pixel0 + channel * p.w * p.h + i;
        let ax = g_image[r + 1u] - g_image[r - 1u];
        let ay = g_image[r + p.w] - g_image[r - p.w];
        let l = ax * ax + ay * ay;
        if (l > square) { square = l; dx = ax; dy = ay; }
    }
    var closest = 0.0lf;
    var signed = 0.0lf;
    var o = 0u;
    @unroll k 0 9 1 {
        let d = TO_X[$k] * dx + TO_Y[$k] * dy;
        let size = select(d, -d, d < 0.0lf);
        if (size > closest) { closest = size; signed = d; o = $ku; }
    }
    g_length[p.pixel0 + i] = nearest_sqrt(f32(square));
    g_bin[p.pixel0 + i] = select(o, o + 9u, signed < 0.0lf);
}

@group(0) @binding(2) var<storage, read> v_length: array<f32>;
@group(0) @binding(3) var<storage, read> v_bin: array<u32>;
@group(0) @binding(4) var<storage, read> v_shares: array<f32>;   // [row 4][col 4][corner of the block of 4 cells]
@group(0) @binding(5) var<storage, read_write> v_out: array<f32>; // [cell][orientation 18]

// 42 cells with 3 threads each; 6 orientations per thread.
@compute @workgroup_size(126)
fn histograms(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = block_of(group);
    if (at >= arrayLength(&blocks)) { return; }
    let p = pictures[blocks[at].x];
    let cell = blocks[at].y + t / 3u;
    let o0 = (t % 3u) * 6u;
    if (cell >= p.rows * p.cols) { return; }
    let y = i32(cell / p.cols);
    let x = i32(cell % p.cols);
    var sum: array<f32, 6>;
    var first: array<f32, 6>;
    @unroll q 0 4 1 {
        let by = y + ($q >> 1u);
        let bx = x + ($q & 1);
        var s: array<f32, 6>;
        @unroll j 0 6 1 { s[$j] = 0.0; }
        @unroll r 0 4 1 {
            var py = by * 4 + $r - 2;
            let is_row = py >= 1 && py <= i32(p.rows) * 4 - 2;
            py = max(min(py, i32(p.h) - 2), 1);
            @unroll c 0 4 1 {
                var px = bx * 4 + $c - 2;
                let counts = is_row && px >= 1 && px <= i32(p.cols) * 4 - 2;
                px = max(min(px, i32(p.w) - 2), 1);
                let pixel = i32(p.pixel0) + py * i32(p.w) + px;
                let o = v_bin[pixel] - o0;
                let v = select(0.0, v_shares[($r * 4 + $c) * 4 + (3 - $q)] * v_length[pixel], counts);
                @unroll j 0 6 1 { s[$j] += select(0.0, v, o == $ju); }
            }
        }
        @unroll j 0 6 1 {
            if ($q == 0 || $q == 2) { first[$j] = s[$j]; }
            if ($q == 1) { sum[$j] = first[$j] + s[$j]; }
            if ($q == 3) { sum[$j] = sum[$j] + (first[$j] + s[$j]); }
        }
    }
    let out = (p.cell0 + cell) * 18u + o0;
    @unroll j 0 6 1 { v_out[out + $j] = sum[$j]; }
}

@group(0) @binding(2) var<storage, read> e_votes: array<f32>;
@group(0) @binding(3) var<storage, read_write> e_out: array<f32>;

@compute @workgroup_size(128)
fn energies(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let i = block_of(group) * 128u + t;
    if (i >= arrayLength(&e_out)) { return; }
    var s = 0.0;
    @unroll o 0 9 1 { let v = e_votes[i * 18u + $o] + e_votes[i * 18u + $o + 9]; s += v * v; }
    e_out[i] = s;
}

@group(0) @binding(2) var<storage, read> f_votes: array<f32>;
@group(0) @binding(3) var<storage, read> f_energies: array<f32>;
@group(0) @binding(4) var<storage, read_write> f_out: array<vec4<f32>>; // [padded cell][channel 32]

fn norm(at: i32, cols: i32) -> f32 {
    let s = f_energies[at] + f_energies[at + 1] + f_energies[at + cols] + f_energies[at + cols + 1];
    return f32(1.0lf / f64(nearest_sqrt(s + 0.0001)));
}

@compute @workgroup_size(128)
fn describe(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = block_of(group);
    if (block >= arrayLength(&blocks)) { return; }
    let p = pictures[blocks[block].x];
    let i = blocks[block].y + t;
    if (i >= p.padded_rows * p.padded_cols) { return; }
    let y = i32(i / p.padded_cols) - i32(p.pad_rows);
    let x = i32(i % p.padded_cols) - i32(p.pad_cols);
    var ch: array<f32, 32>;
    @unroll c 0 31 1 { ch[$c] = 0.0; }
    ch[31] = 1.0;
    let cols = i32(p.cols);
    if (y >= 0 && x >= 0 && y < i32(p.rows) - 2 && x < cols - 2) {
        let e = i32(p.cell0);
        let n0 = norm(e + (y + 1) * cols + x + 1, cols);
        let n1 = norm(e + y * cols + x + 1, cols);
        let n2 = norm(e + (y + 1) * cols + x, cols);
        let n3 = norm(e + y * cols + x, cols);
        let votes = (e + (y + 1) * cols + x + 1) * 18;
        var v: array<f32, 18>;
        var texture = vec4<f32>(0.0);
        @unroll o 0 18 1 {
            v[$o] = f_votes[votes + $o];
            let c = min(v[$o] * vec4<f32>(n0, n1, n2, n3), vec4<f32>(0.2));
            texture += c;
            ch[$o] = 0.5 * (c.x + c.y + c.z + c.w);
        }
        @unroll o 0 9 1 {
            let c = min((v[$o] + v[9 + $o]) * vec4<f32>(n0, n1, n2, n3), vec4<f32>(0.2));
            ch[18 + $o] = 0.5 * (c.x + c.y + c.z + c.w);
        }
        ch[27] = 0.2357 * texture.x;
        ch[28] = 0.2357 * texture.y;
        ch[29] = 0.2357 * texture.z;
        ch[30] = 0.2357 * texture.w;
        ch[31] = 0.0;
    }
    let out = (p.feature0 + i) * 8u;
    @unroll c 0 8 1 { f_out[out + $c] = vec4<f32>(ch[4 * $c], ch[4 * $c + 1], ch[4 * $c + 2], ch[4 * $c + 3]); }
}
