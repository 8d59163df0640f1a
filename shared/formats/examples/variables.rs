//! Lists the variables of a MAT-file: `cargo run --example variables -- FILE`.
#![expect(clippy::print_stdout, reason = "it is what the example is for")]

use std::error::Error;

use formats::mat5::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("give a MAT-file")?;
    for bytes in &formats::mat5::variables(&std::fs::read(file)?)? {
        let (name, value) = formats::mat5::variable(bytes)?;
        let what = match value {
            Value::Numbers(numbers) => format!("numbers, {:?}", numbers.sizes()),
            Value::Structs(structs) => format!("{} structs", structs.len()),
            Value::Cell(values) => format!("a cell of {}", values.len()),
            Value::Other => "of a kind that is not read".to_owned(),
        };
        println!("{name}: {what}");
    }
    Ok(())
}
