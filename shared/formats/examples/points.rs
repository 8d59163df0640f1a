//! Prints the header of a C3D file and its first frame: `cargo run --example points -- FILE`.
#![expect(clippy::print_stdout, reason = "it is what the example is for")]

use std::error::Error;

use formats::c3d::C3d;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("give a C3D file")?;
    let trial = C3d::parse(&std::fs::read(file)?)?;
    let (n_frames, rate_hz) = (trial.n_frames(), trial.rate_hz());
    println!("{n_frames} frames at {rate_hz} Hz, {}", trial.units());
    if n_frames == 0 {
        return Ok(());
    }
    for (name, point) in trial.labels().iter().zip(trial.frame(0)) {
        match point {
            Some([x, y, z]) => println!("{name}: {x} {y} {z}"),
            None => println!("{name}: not seen"),
        }
    }
    Ok(())
}
