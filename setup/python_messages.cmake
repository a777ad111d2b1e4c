# Included by the build of the messages where ROS comes from wheels. There are Python nodes and Fast
# DDS there and nothing else, so the messages go without their C++ and introspection halves, which
# take longer to build than all the rest.
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp:|_introspection_")
set(STATIC_ROSIDL_TYPESUPPORT_C rosidl_typesupport_fastrtps_c)
