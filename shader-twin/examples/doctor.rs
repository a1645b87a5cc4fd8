//! Prints the adapters of this machine, and which one a request gets:
//!
//! ```console
//! SHADER_TWIN_ADAPTER=software cargo run --package shader-twin --example doctor
//! ```

use shader_twin::{Device, Wanted, adapters};

fn main() -> Result<(), shader_twin::Error> {
    let all = adapters();
    println!("{} adapters", all.len());
    all.iter().for_each(|adapter| println!("  {adapter}"));
    let wanted = Wanted::from_env()?;
    let device = Device::open(&wanted)?;
    println!("{wanted}: {}; it computed known numbers", device.adapter());
    Ok(())
}
