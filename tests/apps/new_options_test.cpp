// `tandem new` with --lock, --drop, --density and --dynamics, of a .xacro file, of long names.
#include <sys/stat.h>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

/// A lift and an arm on a planar base; shapes, and no masses.
const char kCart[] = R"(<robot name="cart">
<link name="world"/>
<link name="base"><collision><geometry><box size="0.5 0.4 0.2"/></geometry></collision></link>
<link name="arm"><collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
<link name="hand"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<link name="tool"><collision><geometry><mesh filename="tool.dae"/></geometry></collision></link>
<joint name="drive" type="planar"><parent link="world"/><child link="base"/></joint>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.1"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="60" velocity="3"/><dynamics damping="0.5" friction="0.25"/></joint>
<joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0 0 0.4"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="3"/><dynamics damping="0.1"/></joint>
<joint name="grip" type="prismatic"><parent link="hand"/><child link="tool"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.1" effort="5" velocity="0.1"/></joint>
</robot>
)";

class NewOption : public Program {
 protected:
  /// What `new` writes, `check` takes.
  void checks(const std::string& robot) {
    const Outcome checked = tandem("check " + robot + "/hold.toml");
    EXPECT_EQ(checked.status, 0) << checked.err;
  }
};

TEST_F(NewOption, LocksDropsAndWeighsWhatItsMessagesSay) {
  write_text(folder_ / "cart.urdf", kCart);
  const Outcome refused = tandem("new cart.urdf");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("`tandem new --lock drive` makes it stand still"), std::string::npos)
      << refused.err;
  EXPECT_NE(refused.err.find("joint grip: the joint moves nothing that has mass"),
            std::string::npos)
      << "both defects are told: " << refused.err;
  const Outcome made =
      tandem("new cart.urdf --lock drive --lock wrist=0.25 --drop grip --density 1000");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("arm: 3.142 kg (guess: 1 shape)"), std::string::npos) << made.out;
  const std::string robot = read_text(folder_ / "cart/robot.toml");
  EXPECT_NE(robot.find("drive = 0\nwrist = 0.25\n"), std::string::npos) << robot;
  const std::string urdf = read_text(folder_ / "cart/cart.urdf");
  EXPECT_EQ(urdf.find("name=\"tool\""), std::string::npos);
  EXPECT_EQ(urdf.find("name=\"grip\""), std::string::npos);
  EXPECT_NE(urdf.find("<mass value=\"3.14"), std::string::npos);
  checks("cart");
}

TEST_F(NewOption, NamesWhatIsNotThere) {
  write_text(folder_ / "cart.urdf", kCart);
  for (const auto& [flags, said] :
       {std::pair{"--lock drve",
                  "--lock drve: the description has no joint 'drve' to lock (did "
                  "you mean 'drive'?)"},
        {"--lock wrist=half", "'half' is no number"},
        {"--lock drive --lock wrist=7", "--lock wrist: locks the joint at 7.0"},
        {"--drop tol",
         "--drop: the description has no link and no joint 'tol' (did you mean "
         "'tool'?)"},
        {"--drop world", "'world' is the root"},
        {"--density 0", "--density"}}) {
    const Outcome outcome = tandem(std::string("new cart.urdf ") + flags);
    EXPECT_EQ(outcome.status, 2) << flags;
    EXPECT_NE(outcome.err.find(said), std::string::npos) << flags << ": " << outcome.err;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cart"));
}

TEST_F(NewOption, PutsTheDescriptionsDampingIntoTheDrives) {
  write_text(folder_ / "cart.urdf", kCart);
  const std::string flags = " --lock drive --drop grip --density 1000";
  const Outcome without = tandem("new cart.urdf -o without" + flags);
  const Outcome with = tandem("new cart.urdf -o with --dynamics" + flags);
  ASSERT_EQ(without.status, 0) << without.err;
  ASSERT_EQ(with.status, 0) << with.err;
  EXPECT_NE(without.err.find("<dynamics>"), std::string::npos) << without.err;
  EXPECT_EQ(with.err.find("<dynamics>"), std::string::npos) << with.err;
  const std::string robot = read_text(folder_ / "with/robot.toml");
  EXPECT_NE(robot.find("0.5 of its damping the description's, its friction the description's"),
            std::string::npos)
      << robot;
  EXPECT_NE(robot.find("\nfriction_Nm = 0.25  # the description's\n"), std::string::npos) << robot;
  checks("with");
  edit("cart.urdf", "friction=\"0.25\"", "friction=\"40\"");
  const Outcome much = tandem("new cart.urdf -o much --dynamics" + flags);
  EXPECT_NE(much.err.find("the friction of 1 joint (<dynamics>) is not used: it would take more "
                          "than half of the effort"),
            std::string::npos)
      << much.err;
}

/// The command of a message that has " --WHAT" in it: all between its quotes.
std::string command_in(const std::string& text, const std::string& what) {
  const std::size_t at = text.find(" --" + what);
  if (at == std::string::npos) return {};
  const std::size_t begin = text.rfind('`', at) + 1;
  return text.substr(begin, text.find('`', begin) - begin);
}

// A caster got a guessed drive without a word, and the hint of a weak one did not name --lock.
TEST_F(NewOption, NamesCommandsForJointsWithoutAMotorThatWork) {
  write_text(folder_ / "cart.urdf", kCart);
  edit("cart.urdf", "effort=\"5\" velocity=\"3\"", "effort=\"0\" velocity=\"3\"");
  const Outcome made = tandem("new cart.urdf -o 'my cart' --lock drive --drop grip --density 1000");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.err.find("joint wrist: its <limit effort> is 0, and 1 joint has more"),
            std::string::npos)
      << made.err;
  EXPECT_NE(made.err.find("my cart/cart.urdf:"), std::string::npos)
      << "the lines are those of the copy: " << made.err;
  for (const std::string what : {"lock", "drop"}) {
    const std::string command = command_in(made.err, what + " wrist");
    ASSERT_TRUE(command.starts_with("tandem new cart.urdf -o ")) << what << made.err;
    const Outcome again = tandem(command.substr(7));
    ASSERT_EQ(again.status, 0) << command << again.err;
    EXPECT_EQ(again.err.find("joint wrist"), std::string::npos) << again.err;
    const std::string robot = read_text(folder_ / "my cart/robot.toml");
    EXPECT_EQ(robot.find("\"wrist\""), std::string::npos) << "it is no [[joint]]: " << robot;
    checks("'my cart'");
  }
  // One that carries another joint, and is too weak: it is locked where it is.
  write_text(folder_ / "weak.urdf", kCart);
  edit("weak.urdf", "effort=\"60\"", "effort=\"0.05\"");
  edit("weak.urdf", "<origin xyz=\"0 0 0.2\"/>", "<origin xyz=\"0.4 0 0.1\"/>");  // never upright
  const Outcome weak = tandem("new weak.urdf --lock drive --drop grip --density 1000");
  ASSERT_EQ(weak.status, 0) << weak.err;
  const std::string command = command_in(weak.err, "lock shoulder=");
  ASSERT_FALSE(command.empty()) << weak.err;
  const Outcome again = tandem(command.substr(7));
  ASSERT_EQ(again.status, 0) << command << again.err;
  EXPECT_EQ(again.err.find("shoulder"), std::string::npos) << again.err;
  checks("weak");
}

TEST_F(NewOption, GivesErrorsOfAChangedDescriptionNoLinesOfTheFile) {
  write_text(folder_ / "cart.urdf", kCart);
  const Outcome refused = tandem("new cart.urdf --lock drive --drop wrist");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("cart.urdf: joint shoulder"), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find("cart.urdf:1"), std::string::npos) << refused.err;
}

TEST_F(NewOption, ListsMassesAndWhatTheyAreFrom) {
  write_text(folder_ / "cart.urdf", kCart);
  write_text(folder_ / "tool.dae", "<COLLADA/>");
  edit("cart.urdf", "<link name=\"hand\">",
       "<link name=\"hand\"><inertial><mass value=\"0.5\"/><inertia ixx=\"0.001\" ixy=\"0\" "
       "ixz=\"0\" iyy=\"0.001\" iyz=\"0\" izz=\"0.001\"/></inertial>");
  const Outcome made = tandem("new cart.urdf --lock drive --lock grip --density 1000 --json j");
  ASSERT_EQ(made.status, 0) << made.err;
  const nlohmann::json masses = json("j")["masses"];
  EXPECT_NEAR(masses["arm"]["mass_kg"].get<double>(), 1000.0 * M_PI * 0.05 * 0.05 * 0.4, 1e-6);
  EXPECT_EQ(masses["arm"]["from"], "density");
  EXPECT_NEAR(masses["base"]["mass_kg"].get<double>(), 40.0, 1e-6);
  EXPECT_EQ(masses["hand"]["from"], "urdf");
  EXPECT_EQ(masses["hand"]["mass_kg"], 0.5);
  EXPECT_TRUE(masses["tool"]["mass_kg"].is_null());
  EXPECT_EQ(masses["tool"]["note"], "none, for its mesh tool.dae: this is no STL");
  EXPECT_EQ(masses["world"]["note"], "none, for it has no <collision> and no <visual>");
  EXPECT_EQ(masses.size(), 5U);
}

TEST_F(NewOption, SaysWhyALinkGetsNoMassWhereThatIsWhatItNeeds) {
  write_text(folder_ / "cart.urdf", kCart);
  edit("cart.urdf", "<collision><geometry><sphere radius=\"0.05\"/></geometry></collision>", "");
  const std::string flags = " --lock drive --drop grip --density 1000";
  const Outcome refused = tandem("new cart.urdf" + flags);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("joint wrist: the joint moves nothing that has mass: --density gives "
                             "link 'hand' none, for it has no <collision> and no <visual>"),
            std::string::npos)
      << refused.err;
  EXPECT_EQ(refused.err.find("has --density"), std::string::npos) << refused.err;
  const Outcome made = tandem("new cart.urdf --lock wrist" + flags);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("world, hand: none, for it has no <collision>"), std::string::npos)
      << made.out;
}

TEST_F(NewOption, TakesADensityThatNoLinkNeeds) {
  edit("double_pendulum.urdf", "</robot>",
       "<link name='frame'/><joint name='to_frame' type='fixed'><parent link='link1'/><child "
       "link='frame'/></joint></robot>");
  const Outcome made = tandem("new double_pendulum.urdf -o d --density 1000");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("frame: none, for it has no"), std::string::npos) << made.out;
}

TEST_F(NewOption, LeavesOutOrLocksALeaderOrAFollower) {
  write_text(folder_ / "cart.urdf", kCart);
  edit("cart.urdf", "</robot>",
       "<link name='thumb'><collision><geometry><sphere radius='0.02'/></geometry></collision>"
       "</link><joint name='pinch' type='prismatic'><parent link='hand'/><child link='thumb'/>"
       "<axis xyz='1 0 0'/><limit lower='0' upper='0.1' effort='5' velocity='0.1'/>"
       "<mimic joint='grip'/></joint></robot>");
  const std::string flags = " --force -o c --lock drive --density 1000";
  const Outcome refused = tandem("new cart.urdf --drop grip" + flags);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("--drop: joint 'pinch' mimics joint 'grip', which goes away (leave "
                             "it out, too: --drop pinch; or let it stand still: --lock pinch)"),
            std::string::npos)
      << refused.err;
  for (const char* remedy : {" --drop grip --drop pinch", " --drop grip --lock pinch",
                             " --drop pinch --lock grip", " --lock pinch --lock grip"}) {
    const Outcome made = tandem("new cart.urdf" + flags + remedy);
    EXPECT_EQ(made.status, 0) << remedy << made.err;
    checks("c");
  }
}

TEST_F(NewOption, ExpandsXacroByTheProgramOrSaysTheCommand) {
  write_text(folder_ / "arm.urdf.xacro", "<robot xmlns:xacro='x'><xacro:arm/></robot>");
  std::filesystem::create_directories(folder_ / "bin");
  const Outcome none =
      tandem("new arm.urdf.xacro", "PATH=" + shell_word(folder_.string() + "/bin"));
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("xacro arm.urdf.xacro > arm.urdf"), std::string::npos) << none.err;
  write_text(folder_ / "bin/xacro",
             "#!/bin/sh\necho 'warning: old syntax' >&2\n[ \"$2\" = -o ] && cp " +
                 shell_word((folder_ / "double_pendulum.urdf").string()) + " \"$3\"\n");
  ::chmod((folder_ / "bin/xacro").c_str(), 0755);
  const std::string path = "PATH=" + shell_word(folder_.string() + "/bin") + ":$PATH";
  const Outcome made = tandem("new arm.urdf.xacro", path);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(read_text(folder_ / "arm/arm.urdf"), read_text(folder_ / "double_pendulum.urdf"));
  checks("arm");
  write_text(folder_ / "bin/xacro", "#!/bin/sh\necho 'undefined name: prefix' >&2\nexit 3\n");
  const Outcome failed = tandem("new arm.urdf.xacro -o other", path);
  EXPECT_EQ(failed.status, 2);
  EXPECT_NE(failed.err.find("xacro ends with status 3: undefined name: prefix"), std::string::npos)
      << failed.err;
}

TEST_F(NewOption, ShortensALongNameOfItsOwn) {
  const std::string name(70, 'a');
  std::filesystem::copy_file(folder_ / "double_pendulum.urdf", folder_ / (name + ".urdf"));
  const Outcome made = tandem("new " + name + ".urdf");
  ASSERT_EQ(made.status, 0) << made.err;
  checks(name.substr(0, 64));
}

TEST_F(NewOption, ChecksSoftLimitsThatRobotTomlGoesBeyond) {
  edit("double_pendulum.urdf", "</joint>",
       "<safety_controller soft_lower_limit=\"-0.5\" soft_upper_limit=\"0.5\"/></joint>");
  const Outcome old = tandem("check robot.toml");
  EXPECT_NE(old.err.find("the soft limit (<safety_controller>) of 1 joint is not used"),
            std::string::npos)
      << old.err;
  const Outcome made = tandem("new double_pendulum.urdf -o soft");
  ASSERT_EQ(made.status, 0) << made.err;
  const Outcome checked = tandem("check soft/robot.toml");
  EXPECT_EQ(checked.err.find("safety_controller"), std::string::npos) << checked.err;
}

}  // namespace
}  // namespace tandem::apps
