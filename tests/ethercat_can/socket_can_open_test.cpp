// What opening a bus says where it cannot: on a machine with CAN and on one without.
#include "hal/ethercat-can/socket_can_bus.hpp"

#include <sys/socket.h>
#include <unistd.h>

namespace tandem::hal::can {
namespace {

bool kernel_has_can() {
  const int socket = ::socket(PF_CAN, SOCK_RAW, 1);
  if (socket < 0) return false;
  ::close(socket);
  return true;
}

TEST(SocketCanOpen, NamesTheInterfaceTheCauseAndTheNextStep) {
  const auto bus = SocketCanBus::open({.interface = "tandem_none"});
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().message, kernel_has_can()
                                     ? "CAN interface tandem_none: there is no such interface"
                                     : "CAN interface tandem_none: this kernel has no CAN");
  EXPECT_NE(bus.error().hint.find(kernel_has_can() ? "ip link add tandem_none type vcan"
                                                   : "sudo modprobe can_raw"),
            std::string::npos)
      << bus.error().hint;
}

TEST(SocketCanOpen, RefusesANameThatTheKernelCouldNotHave) {
  for (const char* name : {"", "sixteen_letters_"}) {
    const auto bus = SocketCanBus::open({.interface = name});
    ASSERT_FALSE(bus);
    EXPECT_NE(bus.error().message.find("1 to 15 characters"), std::string::npos)
        << bus.error().message;
  }
}

}  // namespace
}  // namespace tandem::hal::can
