//! Other crates on the problems that Feedwright's benches leave in files. `arc FILE`: copp's TOPP2-RA on a circle; `jerk FILE`: its
//! TOPP3-SOCP on a straight path under a limit of jerk; `gcode FILE`: the crate gcode on a program. Prints one line:
//! `RESULT seconds agreement`, the best of several runs.

use copp::path::{Jet3, Path, cos, sin};
use copp::robot::Robot;
use copp::solver::topp2_ra::{ReachSet2OptionsBuilder, Topp2ProblemBuilder, topp2_ra};
use copp::solver::topp3_socp::{ClarabelOptionsBuilder, Topp3ProblemBuilder, s_to_t_topp3, topp3_socp};
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Times a problem is solved; the fastest counts.
const RUNS: usize = 5;
/// Linearisations of the jerk: the first about the optimum without it, the others about the answer before.
const LINEARISATIONS: usize = 3;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [kind, file] = &words[..] else { return Err("arc, jerk or gcode, and a file".into()) };
    let text = std::fs::read_to_string(file)?;
    let (seconds, agreement) = match kind.as_str() {
        "arc" => arc(&text)?,
        "jerk" => jerk(&text)?,
        "gcode" => gcode(&text),
        _ => return Err("arc, jerk or gcode".into()),
    };
    println!("RESULT {seconds} {agreement}");
    Ok(())
}

/// The number behind a name at the head of a file.
fn value(text: &str, name: &str) -> Outcome<f64> {
    let mut words = text.lines().next().ok_or("empty")?.split_whitespace().skip_while(|word| *word != name);
    Ok(words.nth(1).ok_or("no such value")?.parse()?)
}

/// The two columns of a file.
fn columns(text: &str) -> Outcome<[Vec<f64>; 2]> {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for line in text.lines().skip(2) {
        let (a, b) = line.split_once(',').ok_or("two columns")?;
        first.push(a.parse()?);
        second.push(b.parse()?);
    }
    Ok([first, second])
}

fn fastest<T>(mut run: impl FnMut() -> Outcome<T>) -> Outcome<(f64, T)> {
    let mut best: Option<(f64, T)> = None;
    for _ in 0..RUNS {
        let start = Instant::now();
        let answer = run()?;
        let seconds = start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|(least, _)| seconds < *least) {
            best = Some((seconds, answer));
        }
    }
    best.ok_or_else(|| "no run".into())
}

fn arc(text: &str) -> Outcome<(f64, String)> {
    let (radius, v, a) = (value(text, "radius")?, value(text, "velocity")?, value(text, "acceleration")?);
    let [s, ours] = columns(text)?;
    let n = s.len();
    let circle = move |s: Jet3| vec![radius * cos(s / radius), radius * sin(s / radius)];
    let path = Path::from_parametric(circle, 0.0, s[n - 1])?;
    let mut robot = Robot::with_capacity(2, n);
    let [speed, slow, accel, brake] = [v, -v, a, -a].map(|limit| vec![limit; 2]);
    robot
        .with_s(s.as_slice())?
        .with_q_from_path_2nd(&path, 0, n)?
        .with_axial_velocity((speed.as_slice(), n), (slow.as_slice(), n), 0)?
        .with_axial_acceleration((accel.as_slice(), n), (brake.as_slice(), n), 0)?;
    let problem = Topp2ProblemBuilder::new(&robot, (0, n - 1), (0.0, 0.0)).build()?;
    let options = ReachSet2OptionsBuilder::new().build()?;
    let (seconds, theirs) = fastest(|| Ok(topp2_ra(&problem, &options)?))?;
    let most = theirs.iter().fold(0.0, |most: f64, b| most.max(b.sqrt()));
    let apart = (0..n).map(|i| (ours[i].sqrt() - theirs[i].sqrt()).abs()).fold(0.0, f64::max);
    Ok((seconds, format!("speeds within {:.1e} of the largest", apart / most)))
}

/// The gap is how much longer ours takes to travel than theirs.
fn jerk(text: &str) -> Outcome<(f64, String)> {
    let (j, a, travel) = (value(text, "jerk")?, value(text, "acceleration")?, value(text, "travel")?);
    let [s, caps] = columns(text)?;
    let n = s.len();
    let path = Path::from_parametric(|s: Jet3| vec![s], 0.0, s[n - 1])?;
    let solve = || -> Outcome<f64> {
        let mut robot = Robot::with_capacity(1, n);
        robot.with_s(s.as_slice())?.with_q_from_path_3rd(&path, 0, n)?;
        for (i, cap) in caps.iter().enumerate() {
            let v = cap.sqrt();
            robot.with_axial_velocity((&[v][..], 1), (&[-v][..], 1), i)?;
        }
        robot.with_axial_acceleration((&[a][..], n), (&[-a][..], n), 0)?.with_axial_jerk(
            (&[j][..], n),
            (&[-j][..], n),
            0,
        )?;
        let without = {
            let problem = Topp2ProblemBuilder::new(&robot, (0, n - 1), (0.0, 0.0)).build()?;
            topp2_ra(&problem, &ReachSet2OptionsBuilder::new().build()?)?
        };
        robot.constraints.amax_substitute(&without, 0)?;
        let options = ClarabelOptionsBuilder::new().allow_almost_solved(true).build()?;
        let (mut about, mut least) = (without, f64::INFINITY);
        for _ in 0..LINEARISATIONS {
            let problem =
                Topp3ProblemBuilder::new(&mut robot, 0, &about, (0.0, 0.0), (0.0, 0.0)).build_with_linearization()?;
            let answer = topp3_socp(&problem, &options)?;
            least = least.min(s_to_t_topp3(&s, answer.as_parts(), 0.0)?.0);
            about.clone_from(&answer.a);
        }
        Ok(least)
    };
    let start = Instant::now();
    let theirs = solve()?;
    let seconds = start.elapsed().as_secs_f64();
    let gap = 100.0 * (travel / theirs - 1.0);
    Ok((seconds, format!("travel {travel:.4} s, theirs {theirs:.4} s: gap {gap:+.3} %")))
}

fn gcode(text: &str) -> (f64, String) {
    let blocks = |text: &str| match gcode::parse(text) {
        Ok(program) => Ok(program.blocks.len()),
        Err(found) => Ok(found.iter().count()),
    };
    let (seconds, count) = fastest(|| blocks(text)).unwrap_or_default();
    let kind = if gcode::parse(text).is_ok() { "blocks" } else { "diagnostics" };
    (seconds, format!("{count} {kind}"))
}
