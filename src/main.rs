//! The binary: hands the arguments to [`feedwright::cli`].

fn main() -> std::process::ExitCode {
    feedwright::cli::run()
}
