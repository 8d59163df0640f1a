//! Moves a bar with the right wrist of the person that a running deployment follows.
//!
//! `cargo run -p parallax-client --example wrist -- demo "right wrist"`
#![expect(clippy::print_stdout, reason = "an example prints its results")]

use std::time::Duration;

use parallax_client::{Client, ClientError, State, Wish};

/// Half of the width that the bar shows, in metres.
const REACH_M: f64 = 2.0;
const WIDTH: usize = 60;

fn main() -> Result<(), ClientError> {
    let mut arguments = std::env::args().skip(1);
    let deployment = arguments.next().unwrap_or_else(|| "demo".to_owned());
    let joint = arguments.next().unwrap_or_else(|| "right wrist".to_owned());
    let mut client = Client::wait_for(&deployment, &Wish::skeletons())?;
    loop {
        let Some(moment) = client.next(Duration::from_secs(1))? else {
            let words = match client.state() {
                State::Waiting => "waiting for the deployment",
                State::Connected => "no result has arrived for a second",
            };
            println!("{words}");
            continue;
        };
        let found = moment.followed().and_then(|person| person.joint(&joint));
        match found.map(|joint| joint.found) {
            Some(Ok(place)) => {
                let [x, y, z] = place.in_world;
                let share = f64::midpoint(x / REACH_M, 1.0).clamp(0.0, 1.0);
                let column = (share * (WIDTH - 1) as f64).round() as usize;
                println!(
                    "{:>6} {}#{} {x:+.3} {y:+.3} {z:+.3} m, \u{b1} {:.3} m, {} missed",
                    moment.frame,
                    "-".repeat(column),
                    "-".repeat(WIDTH - 1 - column),
                    place.deviation_m,
                    moment.n_missed
                );
            }
            Some(Err(why)) => println!("{:>6} {joint}: {}", moment.frame, why.reason()),
            None => println!("{:>6} no skeleton", moment.frame),
        }
    }
}
