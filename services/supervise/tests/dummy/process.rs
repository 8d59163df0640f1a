//! A process that works or fails, depending on its first argument.

mod alone;

use core::time::Duration;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use messages::{FrameHeader, Status, ViewQuality};
use runtime::{Launch, Service, Woken, run_service};

/// The topic of all dummy processes.
const TOPIC: &str = "data";
const SOON: Duration = Duration::from_millis(50);

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["supervise", base] => alone::supervise(Path::new(base)),
        ["fill", base] => alone::fill(Path::new(base)),
        _ => serve(),
    }
}

fn serve() -> ExitCode {
    let args = std::env::args_os().skip(2); // `service dummy`
    let (launch, rest) = match Launch::from_args(args.skip(1)) {
        Ok(parsed) => parsed,
        Err(error) => return Failure::from(error).exit(),
    };
    let rest: Vec<String> = rest.iter().filter_map(text).collect();
    let number = |index: usize| rest.get(index).and_then(|word| word.parse().ok()).unwrap_or(0);
    run_service(launch, |service| match rest.first().map(String::as_str) {
        Some("send") => send(service, number(1), number(2), number(3) as usize, false),
        Some("send-and-leave") => send(service, number(1), number(2), number(3) as usize, true),
        Some("receive") => receive(service, number(1), false),
        Some("die-at-end") => receive(service, 0, service.epoch() == 0),
        Some("hold") => hold(service),
        Some("wait-for-view") => wait_for_view(service, number(1)),
        Some("die-in-loan") => die_in_loan(service),
        Some("think") => think(service, number(1)),
        Some("hang-once") => hang_once(service),
        Some("compute") => compute(service, number(1), number(2)),
        Some("fail") => Err(failure(number(1))),
        #[expect(clippy::panic, reason = "it is what the test is about")]
        Some("panic") => panic!("on purpose"),
        Some("wrong-type") => wrong_type(service),
        Some("stubborn") => stubborn(service),
        Some("leave") => leave(service),
        Some("orphan") => orphan(service),
        _ => idle(service),
    })
}

fn text(arg: &OsString) -> Option<String> {
    arg.to_str().map(str::to_owned)
}

/// Prints a line, which the supervisor reports as an event.
fn print_line(text: &str) -> Result<(), Failure> {
    use std::io::Write as _;
    writeln!(std::io::stdout().lock(), "{text}").or_fail(ExitKind::Run)
}

fn failure(status: u64) -> Failure {
    let kind = ExitKind::of_status(status as i32).unwrap_or(ExitKind::Run);
    Failure::new(kind, "model.bin: byte 17 is wrong").with_hint("take another")
}

/// Sends `n` frames, then the end of the stream several times.
///
/// * `leaves`: true to exit after the first end of the stream.
fn send(
    service: &Service,
    n: u64,
    pause: u64,
    subscribers: usize,
    leaves: bool,
) -> Result<(), Failure> {
    let publisher = service.bus().slice_publisher::<u8, FrameHeader>(TOPIC)?;
    let waiter = service.bus().waiter();
    service.health().set_total(n);
    publisher.wait_for_subscribers(subscribers, Duration::from_mins(1));
    let mut frame = 0;
    while waiter.wait(Duration::from_millis(pause))? != Woken::Stop {
        let mut loan = publisher.loan(publisher.max_len())?;
        loan.payload_mut().fill(frame as u8);
        let header = loan.header_mut();
        header.stamp.frame = frame;
        header.stamp.session = service.session();
        header.stamp.epoch = service.epoch();
        if frame == n {
            header.status = Status::END;
            loan.send()?;
            service.health().finished();
            if leaves {
                return Ok(());
            }
            waiter.wait(SOON)?;
        } else {
            loan.send()?;
            service.health().sent(frame);
            frame += 1;
            if frame % 16 == 0 {
                print_line(&format!("sent {frame}"))?;
            }
        }
    }
    Ok(())
}

/// Receives frames until the end of the stream, and prints every frame.
///
/// * `dies`: true to be killed at the end of the stream.
fn receive(service: &Service, pause: u64, dies: bool) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let subscriber = service.bus().slice_subscriber::<u8, FrameHeader>(TOPIC, &mut waiter)?;
    while waiter.wait(SOON)? != Woken::Stop {
        while let Some(sample) = subscriber.receive()? {
            let header = sample.header();
            let value = header.stamp.frame as u8;
            if sample.payload().iter().any(|&byte| byte != value) {
                print_line("torn")?;
            }
            if header.status == Status::END {
                if dies {
                    die()?;
                }
                service.health().finished();
                continue;
            }
            service.health().received(1);
            print_line(&format!(
                "got {} {}",
                header.stamp.epoch, header.stamp.frame
            ))?;
            std::thread::sleep(Duration::from_millis(pause));
        }
    }
    Ok(())
}

/// Subscribes, but never reads.
fn hold(service: &Service) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let subscriber = service.bus().slice_subscriber::<u8, FrameHeader>(TOPIC, &mut waiter)?;
    // Waits until it is connected, like a process that dies during its work.
    while subscriber.receive()?.is_none() {
        waiter.wait(SOON)?;
    }
    print_line("holding")?;
    idle(service)
}

/// Waits for a view that does not come, and then goes on without it.
fn wait_for_view(service: &Service, millis: u64) -> Result<(), Failure> {
    let waiter = service.bus().waiter();
    let began = Instant::now();
    service.health().waits(1);
    while began.elapsed() < Duration::from_millis(millis) {
        if waiter.wait(SOON)? == Woken::Stop {
            return Ok(());
        }
    }
    service.health().waits(0);
    print_line("got 0 1")?;
    idle(service)
}

/// At its first start, is killed while it has a loan. After the restart, sends three frames and
/// finishes.
fn die_in_loan(service: &Service) -> Result<(), Failure> {
    if service.epoch() > 0 {
        return send(service, 3, 0, 1, false);
    }
    let publisher = service.bus().slice_publisher::<u8, FrameHeader>(TOPIC)?;
    publisher.wait_for_subscribers(1, Duration::from_mins(1));
    for frame in 0..2 {
        let mut loan = publisher.loan(publisher.max_len())?;
        loan.payload_mut().fill(frame as u8);
        loan.header_mut().stamp.frame = frame;
        loan.send()?;
        // Frames are sent one at a time, so that none is replaced.
        std::thread::sleep(SOON);
    }
    let mut loan = publisher.loan(publisher.max_len())?;
    loan.header_mut().stamp.frame = 99;
    let half = loan.payload_mut().len() / 2;
    loan.payload_mut()[..half].fill(0xaa);
    die()
}

fn die() -> Result<(), Failure> {
    let script = format!("kill -9 {}", std::process::id());
    Command::new("sh").args(["-c", &script]).status().or_fail(ExitKind::Run)?;
    Err(Failure::new(ExitKind::Run, "survived kill -9"))
}

/// At its first start, makes one iteration of its main loop and then hangs.
fn hang_once(service: &Service) -> Result<(), Failure> {
    service.progress().tick();
    while service.epoch() == 0 {
        std::thread::sleep(SOON);
    }
    idle(service)
}

/// Computes for `seconds`, and finishes unless it was interrupted.
fn think(service: &Service, seconds: u64) -> Result<(), Failure> {
    service.progress().tick();
    std::thread::sleep(Duration::from_secs(seconds));
    if service.stop().is_requested() {
        return Ok(());
    }
    idle(service)
}

/// Computes for three seconds without waiting, with `usual` milliseconds per iteration. Then, only at its first
/// start, computes for `long` milliseconds.
fn compute(service: &Service, usual: u64, long: u64) -> Result<(), Failure> {
    let burn = |millis: u64| {
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_millis(millis) && !service.stop().is_requested() {
            core::hint::spin_loop();
        }
    };
    service.progress().tick();
    let begin = Instant::now();
    for frame in 0.. {
        if begin.elapsed() > Duration::from_secs(3) {
            break;
        }
        burn(usual);
        service.health().sent(frame);
    }
    if service.epoch() == 0 {
        burn(long);
    }
    idle(service)
}

/// Finishes at once, and waits for the stop request.
fn idle(service: &Service) -> Result<(), Failure> {
    let waiter = service.bus().waiter();
    service.health().finished();
    while waiter.wait(SOON)? != Woken::Stop {}
    Ok(())
}

fn wrong_type(service: &Service) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    service.bus().subscriber::<ViewQuality>(TOPIC, &mut waiter)?;
    Ok(())
}

/// At its first start, exits with status 0 before it has finished.
fn leave(service: &Service) -> Result<(), Failure> {
    service.progress().tick();
    if service.epoch() > 0 {
        return idle(service);
    }
    Ok(())
}

/// Ignores the stop request.
fn stubborn(service: &Service) -> Result<(), Failure> {
    service.health().finished();
    loop {
        service.progress().tick();
        std::thread::sleep(SOON);
    }
}

/// Starts a child process, and does not end it.
fn orphan(service: &Service) -> Result<(), Failure> {
    let child = Command::new("sleep").arg("600").spawn().or_fail(ExitKind::Run)?;
    print_line(&format!("child {}", child.id()))?;
    idle(service)
}
