//! Benchmark of every stage of the single-view method on one frame. It prints times in milliseconds. They are compared with the limit from
//! the machine's peak rate, with the readable reference implementation, and with other programs.
//!
//! Workloads: 172 x 224 pixels with 26 parts, 6 types each and filters of 5 x 5 cells (PARSE) or
//! 6 x 6 (HumanEva), and 640 x 480 with 6 x 6. Real models and images are used if `../shared` exists beside
//! the clone, synthetic ones otherwise. `scripts/bench --help` explains the columns.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

mod clock;
mod floor;
mod options;
mod readable;
mod stages;
mod table;
mod workload;

use std::process::ExitCode;

use kernels::Isa;

use self::clock::Clock;
use self::floor::Floors;
use self::options::Options;
use self::readable::Readable;
use self::stages::Bench;
use self::table::{Row, Table};
use self::workload::Workload;

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(wrong) => {
            println!("{wrong}");
            return ExitCode::from(2);
        }
    };
    let mut table = Table::new(&options);
    if !options.json {
        println!("{}", table.head());
    }
    for workload in Workload::all(options.quick) {
        if !options.wants_image(&workload.image_name()) {
            continue;
        }
        let readable = Readable::measure(&workload);
        for isa in Isa::available() {
            if !options.wants_isa(isa) {
                continue;
            }
            let floors = Floors::new(&workload, &readable.ranges, isa, options.quick);
            table.peaks.push(floors.peaks.clone());
            for &threads in &options.threads {
                let clock = Clock::new(threads, options.quick);
                let bench = Bench::new(&workload, isa, threads);
                for (stage, times) in bench.run(&clock, &options) {
                    let row = Row::new(&workload, (stage, isa, threads), times);
                    let row = row.compared(&floors, &readable);
                    if !options.json {
                        println!("{row}");
                    }
                    table.rows.push(row);
                }
            }
        }
    }
    if options.json {
        println!("{}", table.json());
    } else {
        println!("{}", table.foot());
    }
    if options.record {
        table.record();
    }
    ExitCode::SUCCESS
}
