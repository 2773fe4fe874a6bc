// A new build of a controller takes the place of the former one while the run goes on, on
// first-order joints. Linked with the real-time trap.
#include <cmath>

#include "tests/runtime/switch_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;
using test::Names;
using test::SwitchRun;

/// Moves its joints on a sine about where they stood, at 1 Hz, by cycles that it counts itself.
struct Build : Controller {
  double amplitude_rad = 0.2;  ///< compiled in
  std::vector<std::size_t> joints{0, 1};
  std::size_t more = 0;             ///< numbers of state beside those of its joints
  std::size_t moved = 0;            ///< of these, that stand in another list
  std::string needs;                ///< a parameter
  std::vector<std::string> live{};  ///< parameters, in this order
  std::vector<std::string> list{};  ///< elements of a live list "gains"
  double otherwise = 1.0, most = 10.0;
  bool told = false;  ///< it has an input
  bool refuses = false;

  int starts = 0, updates = 0, stops = 0;
  std::int64_t cycles = 0;
  std::vector<double> middle_rad, others;

  Status configure(ControllerSetup& setup) override {
    for (const std::size_t joint : joints) setup.claim(joint, hal::ControlMode::kPosition);
    if (!needs.empty()) (void)setup.parameters.number(needs);
    if (told) (void)setup.input("rate", InputKind::kNumbers, {.names = {"a"}, .max = {1.0}});
    for (const std::string& name : live) {
      (void)setup.parameter(name, {.max = most, .otherwise = otherwise, .live = true});
    }
    if (!list.empty())
      (void)setup.list_parameters("gains", list,
                                  {{.max = most, .otherwise = otherwise, .live = true}});
    middle_rad.assign(joints.size() + moved, 7.0);
    others.assign(more - moved, 0.0);
    if (refuses) return fail("this build has a mistake", "mend it");
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage& command) noexcept override {
    ++starts;
    cycles = 0;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      middle_rad[i] = state.position_rad()[joints[i]];
      command.position_rad()[joints[i]] = 1e3;  // that nobody may ever see
    }
  }
  [[nodiscard]] double wanted_rad(std::size_t i) const {
    return middle_rad[i] + amplitude_rad * std::sin(6.283e-3 * static_cast<double>(cycles));
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    ++updates;
    ++cycles;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      command.position_rad()[joints[i]] = wanted_rad(i);
      command.velocity_rad_s()[joints[i]] =
          amplitude_rad * 6.283 * std::cos(6.283e-3 * static_cast<double>(cycles));
    }
    return Code::kOk;
  }
  void stop() noexcept override { ++stops; }
  void archive(Archive& ar) override { ar(cycles, middle_rad, others); }
};

/// Its first build is "arm", on joints 0 and 1, active; "wrist" is a sine on joint 2, not active.
struct ReloadRun : test::JointRun {
  explicit ReloadRun(std::uint64_t settle_cycles = 0, std::size_t more_state = 0) {
    first->more = more_state;
    add("arm", first);
    add_sine({2}, "wrist", false);
    begin({.running_cycles = 20'000, .settle_cycles = settle_cycles});
  }
  /// Asked for, and not done before the next step.
  [[nodiscard]] Result<Reloaded> ask(std::shared_ptr<Build> next, bool fresh = false) const {
    return services().reload("arm", ControllerSource(std::move(next)), fresh, kNow);
  }
  /// Done by a cycle of its own, which has run.
  Kept reload(const std::shared_ptr<Build>& next, bool fresh = false) {
    const auto asked =
        while_cycling([&] { return services().reload("arm", ControllerSource(next), fresh); });
    EXPECT_TRUE(asked) << asked.error().to_string();
    return asked ? asked->kept : Kept::kNotWanted;
  }
  /// The largest change of joint 0's speed within a cycle [rad], over `count` of them.
  double jerkiest(int count) {
    double before = reference(0), way = NAN, most = 0.0;
    for (int i = 0; i < count; ++i) {
      steps(1);
      const double now = reference(0) - before;
      if (std::isfinite(way)) most = std::max(most, std::abs(now - way));
      way = now;
      before = reference(0);
    }
    return most;
  }

  std::shared_ptr<Build> first = std::make_shared<Build>();
};

std::shared_ptr<Build> build() { return std::make_shared<Build>(); }

TEST(ControllerReload, GoesOnWithTheStateAndTheMotion) {
  ReloadRun run, other;
  run.steps(437);
  other.steps(437);
  ASSERT_TRUE(run.ask(build()));
  double most = 0.0;
  for (int i = 0; i < 300; ++i) {
    run.steps(1);
    other.steps(1);
    most = std::max(most, std::abs(run.reference(0) - other.reference(0)));
  }
  EXPECT_LT(most, 1e-5) << "a cycle's extrapolation";
  EXPECT_NEAR(run.reference(0), other.reference(0), 1e-12) << "which has faded";
  EXPECT_EQ(run.first->stops, 1);
  EXPECT_TRUE(run.cycle->faults().empty());
}

TEST(ControllerReload, RunsTheNewConstantWithoutABump) {
  ReloadRun run;
  run.steps(700);
  const auto next = build();
  next->amplitude_rad = 0.3;
  const double before_rad = run.reference(0);
  ASSERT_TRUE(run.ask(next));
  EXPECT_EQ(next->updates, 0) << "nobody has stepped";
  EXPECT_LT(run.jerkiest(600), 1e-4);
  EXPECT_GT(std::abs(next->wanted_rad(0) - before_rad), 0.02) << "else this shows nothing";
  EXPECT_NEAR(run.reference(0), next->wanted_rad(0), 1e-12);
  EXPECT_EQ(next->updates, 600);
  EXPECT_EQ(next->cycles, run.first->cycles + 600);
  EXPECT_EQ(run.services().controllers()[0].name, "arm");
  EXPECT_TRUE(run.services().controllers()[0].of_experiment);
}

TEST(ControllerReload, StartsAfreshWhereTheStateHasAnotherShape) {
  for (const std::size_t moved : {0U, 1U}) {  // of another size; of the same, in other lists
    ReloadRun run(0, moved == 0 ? 0 : 2);
    run.steps(400);
    const auto next = build();
    next->more = 2;
    next->moved = moved;
    EXPECT_EQ(run.reload(next), Kept::kOtherState);
    EXPECT_EQ(next->starts, 1);
    EXPECT_LT(next->cycles, 100);
    EXPECT_LT(std::abs(next->middle_rad[0]), 1.0) << "where it stood";
    EXPECT_LT(run.jerkiest(1000), 1e-4);
    EXPECT_TRUE(run.cycle->faults().empty());
  }
}

TEST(ControllerReload, StartsAfreshWhereThatIsWantedOrNothingIsArchived) {
  ReloadRun run;
  run.steps(400);
  const auto next = build();
  EXPECT_EQ(run.reload(next, true), Kept::kNotWanted);
  EXPECT_EQ(next->starts, 1);
  ControllerSource source(build());
  source.lacks_archive = true;
  const auto asked = run.while_cycling([&] { return run.services().reload("arm", source); });
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->kept, Kept::kNoArchive);
}

TEST(ControllerReload, OfOtherClaimsTakesAndLeavesJoints) {
  ReloadRun run;
  run.steps(400);
  const auto next = build();
  next->joints = {0, 2};
  EXPECT_EQ(run.reload(next), Kept::kOtherClaims);
  run.steps(400);
  const auto joints = run.services().joints();
  EXPECT_EQ(joints[0].owner, "arm");
  EXPECT_EQ(joints[1].owner, "");
  EXPECT_EQ(joints[2].owner, "arm");
  const double held_rad = run.reference(1);
  run.steps(100);
  EXPECT_EQ(run.reference(1), held_rad);
}

TEST(ControllerReload, IsRefusedWhereAnotherHasAJointThatItClaimsAndTheFormerGoesOn) {
  ReloadRun run;
  run.steps(100);
  ASSERT_TRUE(run.services().switch_controllers({}, {"wrist"}, kNow));
  run.steps(100);
  const auto next = build();
  next->joints = {0, 1, 2};
  const auto asked =
      run.while_cycling([&] { return run.services().reload("arm", ControllerSource(next)); });
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().key, "wrist");
  EXPECT_EQ(asked.error().message, "is claimed by the controllers 'arm' and 'wrist'");
  EXPECT_EQ(asked.error().hint, "stop the other one first: tandem controller stop wrist");
  const int before = run.first->updates;
  run.steps(10);
  EXPECT_EQ(run.first->updates, before + 10);
  EXPECT_EQ(run.first->stops, 0);
  EXPECT_EQ(next->starts, 0);
}

TEST(ControllerReload, ThatCannotBeConfiguredLeavesTheFormerAtWork) {
  ReloadRun run;
  run.steps(100);
  const auto refuses = build(), needs = build(), good = build();
  refuses->refuses = true;
  needs->needs = "gain";
  const auto asked = run.ask(refuses);
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().message, "this build has a mistake");
  for (int i = 0; i < 2; ++i) {
    const auto missing = run.ask(needs);
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.find("gain"), std::string::npos) << missing.error().message;
  }
  const int before = run.first->updates;
  run.steps(10);
  EXPECT_EQ(run.first->updates, before + 10);
  EXPECT_EQ(run.reload(good), Kept::kState) << "and no error of a former try stays";
}

TEST(ControllerReload, OfARenamedParameterNamesBothAndWhatToDo) {
  test::JointRun run;
  const auto needs = [](const std::string& parameter) {
    auto made = build();
    made->needs = parameter;
    return made;
  };
  run.host->read_from(test::document_of("gain = 2.0"));
  run.add("arm", needs("gain"), true, "gain = 2.0");
  run.begin({.running_cycles = 1000});
  run.steps(100);
  for (const char* name : {"gains", "stiffness"}) {
    const auto asked = run.services().reload("arm", ControllerSource(needs(name)), false, kNow);
    ASSERT_FALSE(asked);
    const std::string& message = asked.error().message;
    EXPECT_NE(message.find("gain: unknown key"), std::string::npos) << message;
    EXPECT_NE(message.find(name), std::string::npos) << message;
    EXPECT_NE(message.find("unload it, and load it with others"), std::string::npos) << message;
  }
}

TEST(ControllerReload, OfAnInactiveOneTakesItsPlaceAndStartsNothing) {
  ReloadRun run;
  run.steps(100);
  ASSERT_TRUE(run.services().switch_controllers({"arm"}, {}, kNow));
  run.steps(500);
  const auto next = build();
  const double held_rad = run.reference(0);
  EXPECT_EQ(run.reload(next), Kept::kState);
  run.steps(10);
  EXPECT_EQ(next->starts + next->updates, 0);
  EXPECT_EQ(run.reference(0), held_rad);
  ASSERT_TRUE(run.services().switch_controllers({}, {"arm"}, kNow));
  run.steps(10);
  EXPECT_EQ(next->starts, 1);
  EXPECT_EQ(next->updates, 10);
}

TEST(ControllerReload, BeforeTheControllersRunSetsWhatStarts) {
  ReloadRun run(50);
  run.steps(30);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kSettling);
  const auto next = build();
  ASSERT_TRUE(run.ask(next));
  run.steps(100);
  EXPECT_EQ(next->starts, 1);
  EXPECT_GT(next->updates, 10);
  EXPECT_EQ(run.first->starts + run.first->stops, 0) << "it never ran";
}

TEST(ControllerReload, OnItsWayIsTheOnlyOneAndTheFormerIsFreedAfterIt) {
  ReloadRun run;
  run.steps(100);
  const std::weak_ptr<Build> former = run.first;
  run.first.reset();
  ASSERT_TRUE(run.ask(build()));
  EXPECT_FALSE(run.ask(build()));
  ASSERT_TRUE(run.services().switch_controllers({"arm"}, {}, kNow));
  const auto unload = run.services().unload("arm", kNow);
  ASSERT_FALSE(unload);
  EXPECT_EQ(unload.error().message, "the controller is being reloaded");
  EXPECT_FALSE(former.expired()) << "the loop still has it";
  run.steps(1);
  EXPECT_EQ(run.services().controllers().size(), 2U);
  EXPECT_TRUE(former.expired());
  EXPECT_TRUE(run.services().unload("arm", kNow));
}

TEST(ControllerReload, OfNobodyNamesTheNearest) {
  ReloadRun run;
  run.steps(100);
  const auto asked = run.services().reload("amr", ControllerSource(build()), false, kNow);
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().hint, "did you mean 'arm'?");
  const auto none = run.services().reload("arm", false, kNow);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "the controller has no library of its own");
}

/// It would be read by other code than has written it.
TEST(ControllerReload, MakesSnapshotsOfTheFormerBuildOthers) {
  ReloadRun run;
  run.steps(100);
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  ControllerSource source(build());
  source.code.sha256 = "another";
  ASSERT_TRUE(run.services().reload("arm", source, false, kNow));
  run.steps(10);
  const Status restored = run.cycle->restore(*snapshot);
  ASSERT_FALSE(restored);
  EXPECT_NE(restored.error().message.find("other controllers"), std::string::npos);
}

// What was set by hand goes over by its name: the bytes of kp and kd in another order fit as well.
// What nobody has set is the new build's.
TEST(ControllerReload, KeepsWhatWasSetByName) {
  ReloadRun run;
  const auto next = [](std::vector<std::string> live, double otherwise, double most = 10.0) {
    auto build = std::make_shared<Build>();
    build->live = std::move(live);
    build->otherwise = otherwise;
    build->most = most;
    return build;
  };
  const auto value = [&](const std::string& name) {
    const auto all = run.services().parameters("arm");
    for (const ParameterStatus& one : *all)
      if (one.name == name) return one.value;
    return kNotGiven;
  };
  (void)run.reload(next({"kp", "kd"}, 1.0));
  const auto set = run.while_cycling([&] {
    return run.services().set_parameters({{.controller = "arm", .parameter = "kp", .value = 4.0}});
  });
  ASSERT_TRUE(set) << set.error().to_string();
  (void)run.reload(next({"kd", "kp"}, 2.0));
  EXPECT_EQ(value("kp"), 4.0);
  EXPECT_EQ(value("kd"), 2.0) << "the new build's default";
  (void)run.reload(next({"kp", "other"}, 2.0));
  EXPECT_EQ(value("kp"), 4.0) << "also when there are others beside it";
  (void)run.reload(next({"kp"}, 2.0, 3.0));
  EXPECT_EQ(value("kp"), 2.0) << "4 is beyond the new range";
}

TEST(ControllerReload, KeepsWhatWasSetOfAListByTheElementsName) {
  ReloadRun run;
  const auto next = [](std::vector<std::string> list) {
    auto build = std::make_shared<Build>();
    build->list = std::move(list);
    return build;
  };
  (void)run.reload(next({"elbow", "wrist"}));
  const auto set = run.while_cycling([&] {
    return run.services().set_parameters(
        {{.controller = "arm", .parameter = "gains", .value = std::vector<double>{4.0, 5.0}}});
  });
  ASSERT_TRUE(set) << set.error().to_string();
  const std::uint64_t loads = run.services().loads();
  (void)run.reload(next({"wrist", "hand", "elbow"}));
  std::string values;
  const auto all = run.services().parameters("arm");  // a loop over a temporary's part dangles
  for (const ParameterStatus& one : *all)
    values += one.name + " " + std::to_string(static_cast<int>(one.value)) + " ";
  EXPECT_EQ(values, "gains.wrist 5 gains.hand 1 gains.elbow 4 ");
  EXPECT_NE(run.services().loads(), loads) << "what is shown of it is the new build's from now on";
}

// A row for each build had only the last one's calls; a refused one took its name's row.
TEST(ControllerReload, CountsOnOverBuildsAndWhatIsRefusedLeavesNoTrace) {
  ReloadRun run;
  std::vector<std::shared_ptr<Build>> builds{run.first};
  const auto expect_counted = [&] {
    std::uint64_t calls = 0;
    for (const auto& one : builds)
      calls += static_cast<std::uint64_t>(one->starts + one->updates + one->stops);
    const auto rows = run.host->names()->all();
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(rows[0]->name, "arm");
    EXPECT_EQ(rows[0]->calls.count(), calls);
    EXPECT_EQ(rows[1]->name, "wrist");
  };
  run.steps(100);
  ASSERT_FALSE(run.services().load("arm", build(), test::document_of(), kNow));
  const auto mistake = build();
  mistake->refuses = true;
  ControllerSource refused(mistake);
  refused.code = {.name = "arm", .sha256 = "1", .path = "refused.so"};
  ASSERT_FALSE(run.services().reload("arm", refused, false, kNow));
  expect_counted();
  builds.push_back(build());
  ControllerSource next(builds.back());
  next.code = {.name = "arm", .sha256 = "2", .path = "next.so"};
  ASSERT_TRUE(run.services().reload("arm", next, false, kNow));
  run.steps(100);
  expect_counted();
  ASSERT_TRUE(run.services().switch_controllers({"arm"}, {}, kNow));
  run.steps(1);
  ASSERT_TRUE(run.services().unload("arm", kNow));
  run.steps(1);
  builds.push_back(build());
  ASSERT_TRUE(run.services().load("arm", builds.back(), test::document_of(), kNow));
  run.steps(1);
  ASSERT_TRUE(run.services().switch_controllers({}, {"arm"}, kNow));
  run.steps(100);
  expect_counted();
  ASSERT_EQ(run.host->code().size(), 1U);
  EXPECT_EQ(run.host->code()[0].path, "next.so");
}

// An active one that was reloaded was counted three times.
TEST(ControllerReload, LeavesAsManyInputsAsThereAre) {
  ReloadRun run;
  for (int i = 0; i < 3; ++i) {
    const auto next = std::make_shared<Build>();
    next->told = true;
    (void)run.reload(next);
    EXPECT_EQ(run.host->inputs(), 1U);
  }
}

}  // namespace
}  // namespace tandem::runtime
