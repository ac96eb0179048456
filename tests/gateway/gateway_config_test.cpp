#include "modules/gateway/gateway_config.h"

#include <gtest/gtest.h>

#include <string>

namespace rcs::gateway {
namespace {

Result<GatewayConfig> load(const std::string& text) {
  const Result<ParamFile> file = ParamFile::parse(text, "vehicle.toml");
  if (!file) return file.error();
  return load_gateway_config(*file);
}

std::string error(const std::string& text) {
  const Result<GatewayConfig> config = load(text);
  return config ? "" : config.error().message;
}

TEST(GatewayConfig, WithoutKeysItMustBeSetToUnsecured) {
  EXPECT_NE(error("[vehicle]\nname = \"demo3\"\n").find("unsecured = true"), std::string::npos);
  EXPECT_NE(error("[gateway]\nunsecured = false\n").find("rcs keys"), std::string::npos);
  const Result<GatewayConfig> unsecured = load("[gateway]\nunsecured = true\n");
  ASSERT_TRUE(unsecured.ok()) << unsecured.error().message;
  EXPECT_TRUE(unsecured->dds.keys.empty());
  EXPECT_EQ(unsecured->dds.network.interface, "lo");
  const Result<GatewayConfig> secured = load("[gateway.security]\ndirectory = \"/keys/demo3\"\n");
  ASSERT_TRUE(secured.ok()) << secured.error().message;
  EXPECT_EQ(secured->dds.keys, "/keys/demo3");
  EXPECT_NE(
      error("[gateway]\nunsecured = true\n[gateway.security]\ndirectory = \"/k\"\n").find("one"),
      std::string::npos);
}

TEST(GatewayConfig, ValuesPassedToDdsAreChecked) {
  const std::string unsecured = "[gateway]\nunsecured = true\n";
  for (const char* const bad :
       {"interface = \"lo\\\"/><x\"", "interface = \"\"", "interface = \"${HOME}\"",
        "peers = [\"a b\"]", "peers = [\"\"]", "nodes = [\"gateway\"]", "nodes = [\"w m\"]",
        "domain = 233", "domain = -1"}) {
    EXPECT_NE(error(unsecured + bad + "\n"), "") << bad;
  }
  EXPECT_EQ(error(unsecured + "interface = \"wlan0.7\"\npeers = [\"10.0.0.2\", \"fe80::1\"]\n"),
            "");
  EXPECT_NE(error(unsecured + "[vehicle]\nname = \"demo 3\"\n"), "");
}

TEST(GatewayConfig, RulesBetweenKeysHold) {
  const std::string unsecured = "[gateway]\nunsecured = true\n";
  EXPECT_NE(error(unsecured + "[gateway.commands]\nrefresh_ms = 3000\n"), "");
  EXPECT_NE(error(unsecured + "[gateway.limits]\nmax_valid_for_ms = 300\n"), "");
  EXPECT_NE(error(unsecured + "[gateway.limits]\nmax_radius_m = 0.05\n"), "");
}

}  // namespace
}  // namespace rcs::gateway
