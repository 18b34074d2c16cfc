//! Realised time against LinuxCNC's planner. With a folder of `prog/NAME.ngc` and `log/NAME.ACC.csv` as argument it
//! compares those; without, it runs the corpus through LinuxCNC (minutes) where that is installed.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/linuxcnc/mod.rs"]
mod linuxcnc;

use std::fs;
use std::path::Path;

fn main() {
    let folder = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    if let Some(folder) = folder {
        stored(Path::new(&folder));
    }
}

fn stored(folder: &Path) {
    let mut logs: Vec<_> = fs::read_dir(folder.join("log")).unwrap().flatten().map(|entry| entry.path()).collect();
    logs.sort();
    for csv in logs.iter().filter(|path| path.extension().is_some_and(|extension| extension == "csv")) {
        let stem = csv.file_stem().unwrap().to_string_lossy().into_owned();
        let (name, acceleration) = stem.rsplit_once('.').unwrap();
        let text = fs::read(folder.join("prog").join(format!("{name}.ngc"))).unwrap();
        let text: String = text.iter().map(|byte| *byte as char).collect();
        let theirs = linuxcnc::read_lines(csv).unwrap();
        let ours = linuxcnc::model(&text, acceleration.parse().unwrap());
        let agreement = linuxcnc::compare(&theirs, &ours);
        println!(
            "{stem:40} {:9.2} s {:9.2} s {:+6.2} %  {:3.0} % of {} blocks",
            agreement.theirs_s,
            agreement.ours_s,
            100.0 * agreement.error(),
            100.0 * agreement.within(),
            agreement.blocks.0
        );
        if std::env::var("LINES").is_ok() {
            let mut last = 0;
            for (line, seconds) in &theirs {
                let mine: f64 = ours.range(last + 1..(*line + 1).max(last + 1)).map(|(_, seconds)| seconds).sum();
                last = *line;
                println!("   {line} {seconds:.3} {mine:.3}");
            }
        }
    }
}
