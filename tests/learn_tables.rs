//! Published tables of steady cuts through calibration and diagnosis (skipped, with a line saying so, where the
//! reference folder is absent).

use feedwright::learn::diagnose::{Options, diagnose};
use feedwright::learn::report::LearnReport;
use feedwright::learn::split::by_blocks;
use feedwright::learn::{columns, table};
use std::path::Path;

const PAPERS: &str = "../shared/reference/papers";

fn lines(file: &str) -> Option<Vec<Vec<String>>> {
    let path = Path::new(PAPERS).join(file);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').map(str::to_owned).collect());
    Some(rows.collect())
}

/// Xu Table 4 in the columns of the interface.
fn table4() -> Option<String> {
    let rows = lines("xu2007_table4_circular.csv")?;
    let mut out = String::from(
        "group,order,feed_mm_min,spindle_rpm,axial_depth_mm,radial_depth_mm,side,path_radius_mm,diameter_mm,flutes,spindle_power_w\n",
    );
    for r in &rows[1..] {
        let feed: f64 = r[6].parse().unwrap();
        let sign = if r[2] == "concave" { "" } else { "-" };
        out += &format!(
            "{}{},{},{},1337,{},{},{},{sign}{},25.4,2,{}\n",
            r[2],
            r[3],
            r[0],
            feed * 60.0,
            r[4],
            r[5],
            r[1],
            r[3],
            r[9]
        );
    }
    Some(out)
}

/// Xu Table 5.
fn table5() -> Option<String> {
    let rows = lines("xu2007_table5_ball.csv")?;
    let mut out = String::from(
        "group,order,feed_mm_min,spindle_rpm,axial_depth_mm,radial_depth_mm,side,shape,diameter_mm,flutes,spindle_power_w\n",
    );
    for r in &rows[1..] {
        let feed: f64 = r[7].parse().unwrap();
        out += &format!("{},{},{},2100,{},{},{},ball,12.7,2,{}\n", r[2], r[0], feed * 60.0, r[5], r[6], r[1], r[10]);
    }
    Some(out)
}

fn diagnosed(csv: &str) -> LearnReport {
    let frame = columns::read(csv.as_bytes(), &[]).unwrap();
    let rows = table::rows(&frame, &[]).unwrap();
    let data = table::data(&frame, &rows, |y| y).unwrap();
    diagnose(&data, &by_blocks(&data, "set-up"), &Options::default()).unwrap()
}

fn show(r: &LearnReport) {
    println!("{}", r.verdict);
    println!(
        "how {} | base {:?} cond {:.1}",
        r.how,
        r.base.iter().map(|v| (v.name.as_str(), v.value, v.std_error)).collect::<Vec<_>>(),
        r.condition
    );
    println!("base train {:?}\n     test {:?}", r.base_train, r.base_test);
    for e in &r.effects {
        println!(
            "  + {} {:?} p {:.2e} {:.2}->{:.2} {}",
            e.name,
            e.parameters.iter().map(|v| (v.value, v.std_error)).collect::<Vec<_>>(),
            e.p_value,
            e.test_rmse_before,
            e.test_rmse_after,
            e.evidence
        );
    }
    for e in &r.rejected {
        println!("  - {}: {}", e.name, e.why);
    }
    println!("  confounded {:?}\n unexplained {:?}", r.confounded, r.unexplained);
    println!("final train {:?}\n      test {:?}", r.final_train, r.final_test);
    for t in &r.transfer {
        println!("  transfer {t:?}");
    }
}

#[test]
fn xu_table_4() {
    let Some(csv) = table4() else { return };
    show(&diagnosed(&csv));
}

#[test]
fn xu_table_5() {
    let Some(csv) = table5() else { return };
    show(&diagnosed(&csv));
}
