//! Volumes: what stations remove against closed forms and against the cells, entry and exit, rasters with little stock,
//! conservation over two programs, the order of convergence of the cells.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::oracle::*;
use engage_common::*;
use feedwright::engage::{Options, engage, engage_and_keep, left_stock};
use feedwright::machine::StockShape;
use feedwright::path::Vec3;
use feedwright::stock::saved;

fn all(map: &feedwright::engage::EngagementMap) -> f64 {
    map.stations.iter().map(|s| f64::from(s.removal_area_mm2) * s.length_mm()).sum()
}

#[test]
fn entry_and_exit_of_a_slot_millimetre_by_millimetre() {
    let mut worst: f64 = 0.0;
    for (mill, degrees) in
        [(Mill::Flat(3.0), 0.0), (Mill::Flat(3.0), 30.0), (Mill::Flat(5.0), 71.0), (Mill::Ball(3.0), 17.0)]
    {
        for spacing in [1.0, 2.5] {
            let at = |u: f64| turned(degrees, u, 0.7, -2.0);
            let mut path = Path::from(at(-20.0));
            path.line(at(20.0));
            let half = 6.0;
            let job = job(vec![mill.tool()], vec![block([-half, -half, -10.0], [half, half, 0.0])]);
            let map = run(&path, &job, 0.1, spacing);
            let uncut = |x: f64, y: f64, z: f64| z < 0.0 && x.abs() < half && y.abs() < half;
            // Area swept per mm of path at s, from the leading half of each of 40 layers.
            let dir = turned(degrees, 1.0, 0.0, 0.0);
            let area = |s: f64| {
                (0..40)
                    .map(|k| {
                        let zeta = 0.05 * (f64::from(k) + 0.5);
                        let radius = match mill {
                            Mill::Ball(r) => (zeta * (2.0 * r - zeta)).sqrt(),
                            _ => mill.radius(),
                        };
                        let arcs = engaged(at(s - 20.0), dir, [radius, zeta, 1.0, 0.0], &uncut);
                        0.05 * radius * arcs.iter().map(|arc| arc[0].cos() - arc[1].cos()).sum::<f64>()
                    })
                    .sum::<f64>()
            };
            let step = 0.01;
            let areas: Vec<f64> = (0..4000).map(|k| area((f64::from(k) + 0.5) * step)).collect();
            let total = areas.iter().sum::<f64>() * step;
            // Windows of whole stations, the shortest of at least a millimetre from each of them on. Deviations relative to a
            // millimetre of the full cut: where one only grazes the edge there is nothing else to be relative to.
            let all = stations(&map, 0);
            for from in all {
                let Some(to) = all.iter().find(|to| to.to_mm >= from.from_mm + 1.0) else { continue };
                let places = [from.from_mm, to.to_mm].map(|s| (s / step).round() as usize);
                let expected = areas[places[0]..places[1]].iter().sum::<f64>() * step;
                let found = removed_between(all, from.from_mm, to.to_mm);
                let length = to.to_mm - from.from_mm;
                let error = (found - expected).abs() / (4.0 * mill.radius() * length);
                if error > 3e-3 {
                    println!(
                        "{mill:?} {degrees}° spacing {spacing} at {:.2}..{:.2}: {found:.4} for {expected:.4}",
                        from.from_mm, to.to_mm
                    );
                }
                worst = worst.max(error);
            }
            let sum = volume_of(&map, 0);
            println!("{mill:?} {degrees}°, spacing {spacing}: whole pass off by {:.4} %", 100.0 * (sum / total - 1.0));
            assert!((sum / total - 1.0).abs() < 1e-3, "{mill:?} {degrees}°: {sum} for {total}");
        }
    }
    println!("worst millimetre: {:.3} % of the full cut", 100.0 * worst);
    assert!(worst < 3e-3, "{worst}");
}

#[test]
fn a_flat_pocket_in_rows() {
    for (degrees, spacing) in [(0.0, 1.0), (28.0, 2.0)] {
        let at = |u: f64, v: f64, z: f64| turned(degrees, u, v, z);
        let mut path = Path::from(at(-10.0, -8.0, 5.0));
        for z in [-1.0, -2.5] {
            path.line(at(-10.0, -8.0, z));
            for row in 0..=8 {
                let (v, to) = (-8.0 + 2.0 * f64::from(row), if row % 2 == 0 { 10.0 } else { -10.0 });
                path.line(at(-to, v, z)).line(at(to, v, z));
            }
            path.line(at(-10.0, -8.0, z + 0.1));
        }
        let job = job(vec![flat(6.0)], vec![block([-20.0, -20.0, -10.0], [20.0, 20.0, 0.0])]);
        let map = run(&path, &job, 0.1, spacing);
        // A rectangle of 26 × 22 mm with corners of 3 mm radius, less eight notches where rows are joined at the other end.
        let notch = integral(-1.0, 1.0, |w| 3.0 - (9.0 - w * w).sqrt());
        let expected = 2.5 * (26.0 * 22.0 - (4.0 - std::f64::consts::PI) * 9.0 - 8.0 * notch);
        println!(
            "pocket at {degrees}°: stations {:+.4} %, cells {:+.4} %",
            100.0 * (all(&map) / expected - 1.0),
            100.0 * (map.removed_mm3 / expected - 1.0)
        );
        assert!((map.removed_mm3 / expected - 1.0).abs() < 1e-3, "{} {expected}", map.removed_mm3);
        assert!((all(&map) / expected - 1.0).abs() < 1e-3, "{} {expected}", all(&map));
    }
}

/// The ends of short blocks that are taken from the samples around them against every end worked out: over a wavy surface
/// whose rows leave the stock and cross a slot, the volume of each millimetre.
#[test]
fn joints_of_short_blocks_agree_with_every_end_worked_out() {
    const STEP: f64 = 0.12;
    const BLOCKS: u32 = 250;
    for tool in [ball(6.0), ball(10.0), ball(3.0)] {
        let surface = |x: f64, y: f64| -0.8 + 0.3 * (0.5 * x).sin() * (0.7 * y).cos();
        let mut path = Path::from([12.0, -20.0, -1.5]);
        path.line([12.0, 20.0, -1.5]);
        for row in 0..6 {
            let y = -3.0 + 0.5 * f64::from(row);
            path.rapid([-2.0, y, 5.0]);
            path.line([-2.0, y, surface(-2.0, y)]);
            (1..=BLOCKS).for_each(|k| {
                let x = -2.0 + STEP * f64::from(k);
                path.line([x, y, surface(x, y)]);
            });
        }
        let job = job(vec![tool], vec![block([0.0, -10.0, -10.0], [25.0, 10.0, 0.0])]);
        // Half a block apart none is a joint.
        let [joined, each] = [1.0, 0.5 * STEP].map(|spacing| run(&path, &job, 0.1, spacing));
        let moves = 0..path.toolpath.moves.len() as u32;
        let rows: Vec<u32> = moves.filter(|k| !stations(&joined, *k).is_empty()).skip(1).collect();
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for about in rows.windows(9) {
            let volume = |map| about.iter().map(|k| volume_of(map, *k)).sum::<f64>();
            largest = largest.max(volume(&each));
            worst = worst.max((volume(&joined) - volume(&each)).abs());
        }
        let whole = all(&joined) / all(&each) - 1.0;
        let fewer = each.stations.len() as f64 / joined.stations.len() as f64;
        println!(
            "joints: worst millimetre {:.3} % of the fullest, whole program {:+.4} %, {fewer:.1} times the stations",
            100.0 * worst / largest,
            100.0 * whole
        );
        // Each is to be within 0.3 % of the truth.
        assert!(worst < 6e-3 * largest && whole.abs() < 1e-3, "{worst} of {largest}, {whole}");
    }
}

#[test]
fn rasters_of_a_ball_with_little_stock() {
    let mut worst: f64 = 0.0;
    for (diameter, pitch, stock, degrees, step) in [
        (6.0, 0.3, 0.2, 0.0, 30.0),
        (6.0, 0.3, 0.2, 17.0, 0.24),
        (10.0, 0.5, 0.2, 63.0, 1.0),
        (6.0, 0.5, 0.1, 90.0, 0.5),
        (6.0, 0.15, 0.2, 5.0, 0.5),
        (6.0, 0.2, 0.05, 40.0, 30.0),
        (6.0, 1.0, 0.3, 0.0, 30.0),
        (10.0, 0.3, 0.2, 22.0, 0.24),
        (10.0, 1.2, 0.5, 45.0, 30.0),
        (3.0, 0.2, 0.2, 80.0, 0.5),
        (3.0, 0.3, 1.0, 10.0, 1.0),
    ] {
        let r = 0.5 * diameter;
        let mut path = Path::from(turned(degrees, -15.0, -3.0, 5.0));
        let rows = (6.0 / pitch) as u32;
        let mut middle = Vec::new();
        for row in 0..rows {
            let v = -3.0 + pitch * f64::from(row);
            let way = if row % 2 == 0 { 1.0 } else { -1.0 };
            path.line(turned(degrees, -15.0 * way, v, -stock));
            let count = (30.0 / step) as u32;
            for k in 1..=count {
                path.line(turned(degrees, way * (-15.0 + step * f64::from(k)), v, -stock));
                if row > rows / 2 && f64::from(k) * step <= 18.0 && f64::from(k - 1) * step >= 12.0
                    || (step > 20.0 && row > rows / 2)
                {
                    middle.push(path.toolpath.moves.len() as u32 - 1);
                }
            }
        }
        let half = if step > 20.0 { 12.0 } else { 10.0 };
        let job = job(vec![ball(diameter)], vec![block([-half, -half, -10.0], [half, half, 0.0])]);
        for cell in [0.1, 0.2] {
            let map = run(&path, &job, cell, 1.0);
            // In the steady state a row takes its pitch times the stock, less the scallops that stay.
            let section = pitch * stock - integral(-0.5 * pitch, 0.5 * pitch, |w| r - (r * r - w * w).sqrt());
            let (mut volume, mut length) = (0.0, 0.0);
            for index in &middle {
                if step > 20.0 {
                    volume += removed_between(stations(&map, *index), 12.0, 18.0);
                    length += 6.0;
                } else {
                    volume += volume_of(&map, *index);
                    length += step;
                }
            }
            let rate = volume / length / section - 1.0;
            println!(
                "ball {diameter} rows {pitch} stock {stock} at {degrees}°, blocks {step}, cell {cell}: rate {:+.3} %, stations against cells {:+.3} %",
                100.0 * rate,
                100.0 * (all(&map) / map.removed_mm3 - 1.0)
            );
            worst = worst.max(rate.abs());
        }
    }
    println!("worst rate of a raster: {:.3} %", 100.0 * worst);
    assert!(worst <= 0.003, "{worst}");
}

#[test]
fn nothing_is_lost_between_two_programs() {
    let rows = |path: &mut Path, z: f64| {
        for row in 0..9 {
            let v = -9.0 + 2.3 * f64::from(row);
            path.line([-20.0, v, z]).line([20.0, v + 1.0, z - 0.7]).rapid([20.0, v, 5.0]).rapid([-20.0, v, 5.0]);
        }
    };
    let job = job(vec![ball(6.0)], vec![block([-10.0, -10.0, -10.0], [10.0, 10.0, 0.0])]);
    let options = Options { cell_mm: Some(0.1), ..Options::default() };
    let (mut first, mut second, mut both) =
        (Path::from([-20.0, -9.0, 5.0]), Path::from([-20.0, -9.0, 5.0]), Path::from([-20.0, -9.0, 5.0]));
    rows(&mut first, -1.0);
    rows(&mut second, -2.0);
    rows(&mut both, -1.0);
    rows(&mut both, -2.0);
    let (one, pieces) = engage_and_keep(&first.toolpath, &job, &options, &|_| {}).unwrap();
    // Without engagement the same stock is left, by the same moves.
    let alone = left_stock(&first.toolpath, &job, &options, &|_| {}).unwrap();
    let both_ways = [&pieces, &alone].map(|pieces| saved::to_bytes(&pieces[0], Vec3::zeros()));
    assert!(alone.len() == pieces.len() && both_ways[0] == both_ways[1]);
    let bytes = saved::to_bytes(&pieces[0], Vec3::zeros());
    let load = |_: &std::path::Path| Ok(bytes.clone());
    let mut next = job.clone();
    next.stocks[0].shape = StockShape::Saved("op10.stock".into());
    let two = engage(&second.toolpath, &next, &Options { loader: Some(&load), ..options }, &|_| {}).unwrap();
    let whole = engage(&both.toolpath, &job, &options, &|_| {}).unwrap();
    let initial = 20.0 * 20.0 * 10.0;
    assert!((one.initial_mm3 / initial - 1.0).abs() < 1e-6);
    let kept = one.removed_mm3 + two.removed_mm3 + two.remaining_mm3;
    println!("removed {:.3} + {:.3}, left {:.3}, of {initial}", one.removed_mm3, two.removed_mm3, two.remaining_mm3);
    assert!((kept / initial - 1.0).abs() < 1e-6, "{kept}");
    assert!((two.remaining_mm3 / whole.remaining_mm3 - 1.0).abs() < 1e-6);
    let field = &pieces[0].field;
    let heights = field.by_row(|tile| &tile.heights);
    let cells: f64 = heights.iter().map(|h| f64::from(*h) + 10.0).sum::<f64>() * field.cell[0] * field.cell[1];
    assert!((cells / one.remaining_mm3 - 1.0).abs() < 1e-6);
}

#[test]
fn halving_the_cell_shows_the_order_of_convergence() {
    // Claimed: second order for the groove of a ball, at least first order for walls, in the root mean square over angles.
    for (mill, order) in [(Mill::Ball(3.0), 1.9), (Mill::Flat(3.0), 1.0)] {
        let error = |cell: f64| {
            let squares: f64 = (0..24)
                .map(|k| {
                    let degrees = 3.0 + 7.3 * f64::from(k);
                    let at = |u: f64| turned(degrees, u, 0.1 * f64::from(k), -2.0);
                    let mut path = Path::from(at(-6.0));
                    path.line(at(6.0));
                    let job = job(vec![mill.tool()], vec![block([-12.0, -12.0, -10.0], [12.0, 12.0, 0.0])]);
                    let map = run(&path, &job, cell, 5.0);
                    let depth = |w: f64| (2.0 - mill.lowest(w.abs())).max(0.0);
                    let round = integral(0.0, 3.0, |w| std::f64::consts::TAU * w * depth(w));
                    let expected = 12.0 * integral(-3.0, 3.0, depth) + round;
                    (map.removed_mm3 / expected - 1.0).powi(2)
                })
                .sum();
            (squares / 24.0).sqrt()
        };
        let errors = [0.4, 0.2, 0.1].map(error);
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        let mean = 0.5 * (orders[0] + orders[1]);
        println!("{mill:?}: errors {errors:?}, orders {orders:?}");
        assert!(mean > order, "{mill:?}: order {mean}");
    }
}
