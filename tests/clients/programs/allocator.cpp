// Keeps a pose with two engines that turn: a force and a moment, allocated by the pseudo-inverse to both engines' axes.
#include <cmath>
#include <cstdio>

#include <geographic_msgs/GeoPoseStamped.h>
#include <geometry_msgs/Quaternion.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/NavSatFix.h>
#include <std_msgs/Float32.h>
#include <vrx_gazebo/Task.h>

namespace {

constexpr double kRadius = 6371000.0, kDegree = M_PI / 180.0;
constexpr double kAstern = -2.37, kAbeam = 1.03;        // place of the engines [m]
constexpr double kAheadMost = 250.0, kAsternMost = 100.0;  // their thrust [N]

double yaw(const geometry_msgs::Quaternion &q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

class Allocator {
 public:
  Allocator() {
    for (int side = 0; side < 2; ++side) {
      const std::string stem = std::string("/wamv/thrusters/") + (side ? "right" : "left");
      thrust_[side] = node_.advertise<std_msgs::Float32>(stem + "_thrust_cmd", 1);
      angle_[side] = node_.advertise<std_msgs::Float32>(stem + "_thrust_angle", 1);
    }
    goals_ = node_.subscribe("/vrx/station_keeping/goal", 1, &Allocator::OnGoal, this);
    fixes_ = node_.subscribe("/wamv/sensors/gps/gps/fix", 1, &Allocator::OnFix, this);
    imus_ = node_.subscribe("/wamv/sensors/imu/imu/data", 1, &Allocator::OnImu, this);
    tasks_ = node_.subscribe("/vrx/task/info", 1, &Allocator::OnTask, this);
  }

 private:
  void OnGoal(const geographic_msgs::GeoPoseStamped &goal) {
    goal_ = goal.pose;
    has_goal_ = true;
  }

  void OnFix(const sensor_msgs::NavSatFix &fix) {
    if (!has_goal_) return;
    const double north = (goal_.position.latitude - fix.latitude) * kDegree * kRadius;
    const double east =
        (goal_.position.longitude - fix.longitude) * kDegree * kRadius * std::cos(fix.latitude * kDegree);
    const double dt = (fix.header.stamp - last_).toSec();
    if (has_fix_ && dt <= 0.0) ROS_FATAL("dt is %f s", dt);
    if (has_fix_) {
      speed_[0] += 0.2 * ((east - error_[0]) / dt - speed_[0]);
      speed_[1] += 0.2 * ((north - error_[1]) / dt - speed_[1]);
    }
    error_[0] = east, error_[1] = north, last_ = fix.header.stamp;
    if (!has_fix_) std::puts("ready"), std::fflush(stdout);
    has_fix_ = true;
  }

  void OnImu(const sensor_msgs::Imu &imu) {
    if (!has_fix_) return;
    const double heading = yaw(imu.orientation);
    const double turn = std::remainder(yaw(goal_.orientation) - heading, 2.0 * M_PI);
    const double east = 80.0 * error_[0] + 200.0 * speed_[0], north = 80.0 * error_[1] + 200.0 * speed_[1];
    Allocate(std::cos(heading) * east + std::sin(heading) * north, std::cos(heading) * north - std::sin(heading) * east,
             400.0 * turn - 600.0 * imu.angular_velocity.z);
  }

  void Allocate(double surge, double sway, double moment) {
    const double size = std::hypot(surge, sway), most = 120.0;
    if (size > most) surge *= most / size, sway *= most / size;
    const double apart = (moment - kAstern * sway) / kAbeam;
    for (int side = 0; side < 2; ++side) {
      double ahead = 0.5 * (side ? surge + apart : surge - apart), across = 0.5 * sway;
      double force = std::hypot(ahead, across), angle = std::atan2(across, ahead);
      if (std::abs(angle) > 0.5 * M_PI) angle -= std::copysign(M_PI, angle), force = -force;
      std_msgs::Float32 thrust, turned;
      thrust.data = std::max(-1.0, std::min(1.0, force / (force > 0.0 ? kAheadMost : kAsternMost)));
      turned.data = angle;
      thrust_[side].publish(thrust);
      angle_[side].publish(turned);
    }
  }

  void OnTask(const vrx_gazebo::Task &task) {
    if (task.timed_out) ROS_FATAL("too late");
  }

  ros::NodeHandle node_;
  ros::Publisher thrust_[2], angle_[2];
  ros::Subscriber goals_, fixes_, imus_, tasks_;
  geographic_msgs::GeoPose goal_;
  ros::Time last_;
  bool has_goal_ = false, has_fix_ = false;
  double error_[2] = {0.0, 0.0}, speed_[2] = {0.0, 0.0};
};

}  // namespace

int main(int argc, char **argv) {
  ros::init(argc, argv, "allocator");
  Allocator allocator;
  ros::spin();
}
