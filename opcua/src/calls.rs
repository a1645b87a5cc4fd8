//! In: calls of clients. Out: requests to the station, transitions, lists. A call that is not possible in a state is
//! Bad_InvalidState; what the station or this program refuses has a number and words.
//! Frame and unit: poses in mm and degrees in the station's notation.

use crate::arguments::{MOST_LETTERS, listed, number, page, plain, recipe, request, structure, words};
use crate::machine::{End, Machine, State, Transition};
use crate::model::data::{JobId, MeasId, PartId, ProductId, RecipeIdExternal, RecipeIdInternal, ResultId};
use crate::model::ids::kind;
use crate::outlet::Told;
use crate::results::{Order, Outcome};
use crate::vision::{Guided, Refusal, Vision, error};
use opcua::types::{DateTime, StatusCode, TryFromVariant, Variant, VariantScalarTypeId};
use sheetlight_registers::{Ask, Job, Stage, is_name};
use std::sync::Arc;

/// What a method gives, or why it cannot be called now.
pub type Given = Result<Vec<Variant>, StatusCode>;

impl Vision {
    /// Calls a method.
    pub async fn call(self: &Arc<Self>, name: &str, arguments: &[Variant]) -> Given {
        match name {
            "SelectModeAutomatic" => self.moves(|machine| machine.select_automatic()),
            "Halt" => self.leaves(arguments, |machine| machine.halt()).await,
            "Reset" => self.leaves(arguments, |machine| machine.reset()).await,
            "StartSingleJob" => self.starts(arguments).await,
            "StartContinuous" => {
                self.operational()?;
                let what = "this vision system runs single jobs only: StartSingleJob".to_owned();
                let number = self.refuses((error::NOT_SERVED, what));
                Ok(vec![JobId::default().into(), number.into()])
            }
            "Stop" => self.ends(arguments, End::Stop).await,
            "Abort" => self.ends(arguments, End::Abort).await,
            "PrepareRecipe" => self.prepares(arguments),
            "UnprepareRecipe" => self.unprepares(arguments),
            "GetRecipeListFiltered" => self.lists_recipes(arguments),
            "GetResultById" => self.result(arguments, false),
            "GetResultComponentsById" => self.result(arguments, true),
            "GetResultListFiltered" => self.lists_results(arguments),
            "AddPose" => self.adds_pose(arguments).await,
            "FindPart" => self.finds_part().await,
            _ => Err(StatusCode::BadMethodInvalid),
        }
    }

    fn operational(&self) -> Result<(), StatusCode> {
        match self.lock().machine.state().is_operational() {
            true => Ok(()),
            false => Err(StatusCode::BadInvalidState),
        }
    }

    /// A transition that needs no station.
    fn moves(&self, by: impl Fn(&mut Machine) -> Option<Transition>) -> Given {
        let mut inner = self.lock();
        let Some(by) = by(&mut inner.machine) else { return Err(StatusCode::BadInvalidState) };
        let mut told = vec![];
        inner.goes(Some(by), &mut told);
        self.show(&inner, told);
        Ok(vec![0i32.into()])
    }

    /// Halt and Reset: what runs is stopped, then the state is left. A station that is not reached does not keep it.
    async fn leaves(&self, arguments: &[Variant], by: impl Fn(&mut Machine) -> Option<Transition>) -> Given {
        number::<i32>(arguments, 0)?;
        let runs = {
            let mut inner = self.lock();
            inner.guided = None;
            inner.starting || inner.machine.state() == State::SingleExecution
        };
        let stopped = if runs && self.runs_jobs() { self.ask(Ask::Stop).await.err() } else { None };
        let mut inner = self.lock();
        let before = inner.machine.state();
        let mut told = vec![];
        let gone = by(&mut inner.machine);
        inner.goes(gone, &mut told);
        // Lost while it is reset: Error again.
        if inner.seen.is_none() {
            let lost = inner.machine.lost();
            inner.goes(lost, &mut told);
        }
        self.show(&inner, told);
        drop(inner);
        match stopped {
            Some(refusal) => Ok(vec![self.refuses(refusal).into()]),
            None if gone.is_none() && before == State::Halted => Err(StatusCode::BadInvalidState),
            None => Ok(vec![0i32.into()]),
        }
    }

    fn runs_jobs(&self) -> bool {
        self.lock().seen.as_ref().is_some_and(|seen| seen.jobs)
    }

    async fn starts(self: &Arc<Self>, arguments: &[Variant]) -> Given {
        let meas = structure::<MeasId>(arguments, 0)?;
        let part = structure::<PartId>(arguments, 1)?;
        let asked = structure::<RecipeIdExternal>(arguments, 2)?;
        let product = structure::<ProductId>(arguments, 3)?;
        let parameters = words(arguments, 4)?;
        let lengths = [
            meas.as_ref().map_or(0, |m| m.id.as_ref().len()),
            part.as_ref().map_or(0, |p| p.id.as_ref().len()),
            product.as_ref().map_or(0, |p| p.id.as_ref().len()),
        ];
        if lengths.iter().any(|n| *n > MOST_LETTERS) {
            return Err(StatusCode::BadInvalidArgument);
        }
        // Only the identifiers are kept with a result.
        let meas = meas.map(|m| MeasId { description: None, ..m });
        let part = part.map(|p| PartId { description: None, ..p });
        let product = product.map(|p| ProductId { description: None, ..p });
        let no = |number: i32| Ok(vec![JobId::default().into(), number.into()]);
        let asked = recipe(asked.as_ref(), None);
        let (ask, prepared, guided) = {
            let mut inner = self.lock();
            if inner.machine.state() == State::SingleExecution || inner.starting {
                drop(inner);
                return no(self.refuses((error::BUSY, "a job runs".into())));
            }
            if inner.machine.state() != State::Ready {
                return Err(StatusCode::BadInvalidState);
            }
            let prepared = inner.machine.recipe().unwrap_or_default().to_owned();
            if !asked.is_empty() && asked != prepared {
                drop(inner);
                let what = format!("the recipe {prepared} is prepared, not {}", plain(&asked));
                return no(self.refuses((error::NOT_PREPARED, what)));
            }
            let guided = inner.seen.as_ref().is_some_and(|seen| !seen.jobs);
            let ask = if guided { Ask::Scan(None) } else { request(&prepared, &parameters)? };
            inner.starting = true;
            (ask, prepared, guided)
        };
        let begun = DateTime::now();
        let answer = self.ask(ask).await;
        let mut guard = self.lock();
        let inner = &mut *guard;
        inner.starting = false;
        if let Err(refusal) = answer {
            drop(guard);
            return no(self.refuses(refusal));
        }
        let job = match guided {
            true => {
                inner.guided_count += 1;
                format!("scan-{}", inner.guided_count)
            }
            false => inner.seen.as_ref().map_or_else(String::new, |seen| seen.job.number.to_string()),
        };
        let order = Order { job: job.clone(), recipe: prepared, meas, part, product, begun };
        let mut told = vec![];
        // Halted or reset meanwhile: the station is asked to stop after this request, and the result is kept.
        let by = inner.machine.starts();
        if guided {
            inner.guided = by.is_some().then_some(Guided { order, shots: 0 });
        } else {
            inner.recorded = None;
            inner.mine = Some(order);
        }
        inner.goes(by, &mut told);
        self.show(inner, told);
        Ok(vec![JobId { id: job.as_str().into() }.into(), 0i32.into()])
    }

    /// Stop and Abort: the station stops what runs; the state follows when it has.
    async fn ends(self: &Arc<Self>, arguments: &[Variant], end: End) -> Given {
        number::<i32>(arguments, 0)?;
        {
            let mut guard = self.lock();
            let inner = &mut *guard;
            if inner.machine.state() != State::SingleExecution {
                return Err(StatusCode::BadInvalidState);
            }
            inner.machine.ends_by(end);
            if let Some(guided) = inner.guided.take() {
                let mut told = vec![];
                let job = Job { stage: Stage::Stopped, ..Job::default() };
                inner.keeps(Outcome::of(job, Some(guided.order), [None, None]), &mut told);
                let by = inner.machine.ended();
                inner.goes(by, &mut told);
                self.show(inner, told);
                return Ok(vec![0i32.into()]);
            }
        }
        match self.ask(Ask::Stop).await {
            Ok(_) => Ok(vec![0i32.into()]),
            Err(refusal) => {
                self.lock().machine.ends_by(End::Auto);
                Ok(vec![self.refuses(refusal).into()])
            }
        }
    }

    /// A recipe's name, if it may be prepared.
    fn known(&self, name: &str) -> Result<(), Refusal> {
        if !is_name(name) {
            let what = format!("'{}' is not a recipe's name: 1 to 40 letters, digits, - and _ are", plain(name));
            return Err((error::NO_NAME, what));
        }
        if !self.recipes.is_empty() && !self.recipes.iter().any(|r| r == name) {
            let what = format!("{name} is not one of the recipes that are offered: {}", self.recipes.join(", "));
            return Err((error::NO_SUCH_RECIPE, what));
        }
        Ok(())
    }

    fn prepares(&self, arguments: &[Variant]) -> Given {
        let (external, internal) = (structure(arguments, 0)?, structure(arguments, 1)?);
        let name = recipe(external.as_ref(), internal.as_ref());
        if !self.lock().machine.takes_recipes() {
            return Err(StatusCode::BadInvalidState);
        }
        if let Err(refusal) = self.known(&name) {
            let number = self.refuses(refusal);
            return Ok(vec![RecipeIdInternal::default().into(), false.into(), number.into()]);
        }
        let mut inner = self.lock();
        // Between the two looks a job may have begun.
        if !inner.machine.takes_recipes() {
            return Err(StatusCode::BadInvalidState);
        }
        let mut told = vec![];
        let by = inner.machine.prepare(&name);
        inner.goes(by, &mut told);
        told.push(
            Told::new(kind::RECIPE_PREPARED, format!("recipe {name} is prepared"))
                .with("ExternalId", RecipeIdExternal::of(&name))
                .with("InternalId", RecipeIdInternal::of(&name)),
        );
        self.show(&inner, told);
        Ok(vec![RecipeIdInternal::of(&name).into(), true.into(), 0i32.into()])
    }

    fn unprepares(&self, arguments: &[Variant]) -> Given {
        let (external, internal) = (structure(arguments, 0)?, structure(arguments, 1)?);
        let name = recipe(external.as_ref(), internal.as_ref());
        let mut inner = self.lock();
        if !inner.machine.takes_recipes() {
            return Err(StatusCode::BadInvalidState);
        }
        let prepared = inner.machine.recipe().unwrap_or_default().to_owned();
        if name != prepared || prepared.is_empty() {
            drop(inner);
            let what = format!("the recipe {} is not prepared", plain(&name));
            let number = self.refuses((error::NOT_PREPARED, what));
            return Ok(vec![RecipeIdInternal::default().into(), number.into()]);
        }
        let mut told = vec![];
        let by = inner.machine.unprepare();
        inner.goes(by, &mut told);
        self.show(&inner, told);
        Ok(vec![RecipeIdInternal::of(&name).into(), 0i32.into()])
    }

    fn lists_recipes(&self, arguments: &[Variant]) -> Given {
        let external = structure::<RecipeIdExternal>(arguments, 0)?;
        let asked = recipe(external.as_ref(), None);
        structure::<ProductId>(arguments, 1)?;
        let prepared: i32 = number(arguments, 2)?;
        let (most, from) = (number::<u32>(arguments, 3)? as usize, number::<u32>(arguments, 4)? as usize);
        let inner = self.lock();
        let now = inner.machine.recipe().map(str::to_owned);
        // Without --recipe only the prepared one is known here.
        let names = if self.recipes.is_empty() { now.iter().cloned().collect() } else { self.recipes.clone() };
        let wanted = |name: &String| {
            let is_prepared = now.as_ref() == Some(name);
            let by_state = match prepared {
                0 => !is_prepared,
                1 => is_prepared,
                _ => true,
            };
            by_state && (asked.is_empty() || *name == asked)
        };
        let names: Vec<String> = names.into_iter().filter(wanted).collect();
        let (complete, part) = page(names, most, from);
        let list: Vec<Variant> = part.iter().map(|name| RecipeIdInternal::of(name).into()).collect();
        Ok(listed(complete, list))
    }

    fn result(&self, arguments: &[Variant], apart: bool) -> Given {
        let id = structure::<ResultId>(arguments, 0)?.unwrap_or_default();
        let found = self.lock().results.find(id.id.as_ref()).map(Outcome::data);
        let missing = match found {
            Some(_) => 0,
            None => {
                let what = format!("there is no result {} among the last ones", plain(id.id.as_ref()));
                self.refuses((error::NO_SUCH_RESULT, what))
            }
        };
        let data = found.unwrap_or_default();
        if !apart {
            return Ok(vec![0u32.into(), data.into(), missing.into()]);
        }
        let content = data.result_content.clone().flatten().unwrap_or_default();
        Ok(vec![
            false.into(),
            0u32.into(),
            data.is_partial.into(),
            false.into(),
            data.result_state.into(),
            data.meas_id.unwrap_or_default().into(),
            data.part_id.unwrap_or_default().into(),
            data.external_recipe_id.unwrap_or_default().into(),
            data.internal_recipe_id.into(),
            data.product_id.unwrap_or_default().into(),
            data.external_configuration_id.unwrap_or_default().into(),
            data.internal_configuration_id.into(),
            data.job_id.into(),
            data.creation_time.into(),
            data.processing_times.unwrap_or_default().into(),
            Variant::from((
                VariantScalarTypeId::Variant,
                content.into_iter().map(|v| Variant::Variant(Box::new(v))).collect::<Vec<_>>(),
            )),
            missing.into(),
        ])
    }

    fn lists_results(&self, arguments: &[Variant]) -> Given {
        let state: i32 = number(arguments, 0)?;
        let meas = structure::<MeasId>(arguments, 1)?.unwrap_or_default().id;
        let part = structure::<PartId>(arguments, 2)?.unwrap_or_default().id;
        let external = structure::<RecipeIdExternal>(arguments, 3)?;
        let internal = structure::<RecipeIdInternal>(arguments, 4)?;
        let name = recipe(external.as_ref(), internal.as_ref());
        let product = structure::<ProductId>(arguments, 7)?.unwrap_or_default().id;
        let job = structure::<JobId>(arguments, 8)?.unwrap_or_default().id;
        let (most, from) = (number::<u32>(arguments, 9)? as usize, number::<u32>(arguments, 10)? as usize);
        let inner = self.lock();
        // An identifier that is empty and the state 0 choose everything.
        let same = |asked: &str, has: &str| asked.is_empty() || asked == has;
        let wanted = |o: &&Outcome| {
            let order = o.order.as_ref();
            let meas_id = order.and_then(|o| o.meas.as_ref()).map_or("", |m| m.id.as_ref());
            let part_id = order.and_then(|o| o.part.as_ref()).map_or("", |p| p.id.as_ref());
            let product_id = order.and_then(|o| o.product.as_ref()).map_or("", |p| p.id.as_ref());
            (state == 0 || state == o.state)
                && same(meas.as_ref(), meas_id)
                && same(part.as_ref(), part_id)
                && same(product.as_ref(), product_id)
                && same(&name, o.recipe())
                && same(job.as_ref(), &o.id)
        };
        let found: Vec<Outcome> = inner.results.newest_first().filter(wanted).cloned().collect();
        let (complete, part) = page(found, most, from);
        Ok(listed(complete, part.iter().map(|outcome| outcome.data().into()).collect()))
    }

    /// The client's robot stands still: the station takes a picture.
    async fn adds_pose(&self, arguments: &[Variant]) -> Given {
        let numbers: Vec<f64> = match arguments.first() {
            Some(v @ Variant::Array(_)) => {
                Vec::try_from_variant(v.clone()).map_err(|_| StatusCode::BadInvalidArgument)?
            }
            _ => return Err(StatusCode::BadInvalidArgument),
        };
        let Ok(flange) = <[f64; 6]>::try_from(numbers) else { return Err(StatusCode::BadInvalidArgument) };
        if !flange.iter().all(|x| x.is_finite()) {
            return Err(StatusCode::BadInvalidArgument);
        }
        if self.lock().guided.is_none() {
            return Err(StatusCode::BadInvalidState);
        }
        match self.ask(Ask::Pose(flange)).await {
            Ok(answer) => {
                let mut inner = self.lock();
                if let Some(guided) = &mut inner.guided {
                    guided.shots = answer.shots;
                }
                self.show(&inner, vec![]);
                Ok(vec![u32::from(answer.shots).into(), 0i32.into()])
            }
            Err(refusal) => {
                let shots = self.lock().guided.as_ref().map_or(0, |guided| guided.shots);
                Ok(vec![u32::from(shots).into(), self.refuses(refusal).into()])
            }
        }
    }

    /// The scan of the client's robot is complete: the part is found and its poses are asked for.
    async fn finds_part(&self) -> Given {
        let Some(guided) = self.lock().guided.take() else { return Err(StatusCode::BadInvalidState) };
        let found = self.ask(Ask::Find(guided.order.recipe.clone())).await;
        let (mut job, mut poses) = (Job { stage: Stage::Failed, ..Job::default() }, [None; 3]);
        let mut number = 0;
        match found {
            Ok(answer) => {
                for (pose, which) in poses.iter_mut().zip(0..) {
                    *pose = self.ask(Ask::Give(which)).await.ok().map(|answer| answer.pose);
                }
                let sigma = [f64::INFINITY; 6];
                job = Job { stage: Stage::Done, found: 1, score: answer.score, sigma, ..job };
                match poses[1] {
                    Some(pose) => job.pose = pose,
                    // Found, and no pose to give: never a pose of zeros.
                    None => job.found = 2,
                }
            }
            Err((code, words)) => {
                (job.error, job.words) = (u16::try_from(code).unwrap_or(u16::MAX), words.clone());
                number = self.refuses((code, words));
            }
        }
        let mut guard = self.lock();
        let inner = &mut *guard;
        let mut told = vec![];
        inner.keeps(Outcome::of(job, Some(guided.order), [poses[0], poses[2]]), &mut told);
        let by = inner.machine.ended();
        inner.goes(by, &mut told);
        self.show(inner, told);
        Ok(vec![number.into()])
    }
}
