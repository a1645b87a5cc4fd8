//! In: nothing. Out: a mark in the library that keeps it in memory after a program has closed it.
//! The scanning engine has a pool of threads that lives as long as the process; their code must not go away.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
