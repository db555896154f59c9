!! Reads an input with razy's library and prints how many coordinates its machine has.
program consumer
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_machine_machine, only: machine_t
   use razy_scenes_records, only: record_t
   use razy_scenes_case, only: motion_t, new_machine, read_study
   implicit none(type, external)

   type(error_t), allocatable :: error
   type(input_t) :: input
   type(machine_t) :: machine
   type(motion_t) :: motion
   type(record_t), allocatable :: records(:)
   type(string_t) :: none(0)
   character(:), allocatable :: text
   character(1024) :: file
   integer :: unused

   call get_command_argument(1, file)
   call read_text_file(trim(file), text, error)
   if (.not. allocated(error)) call read_study(input, text, trim(file), none, error)
   if (.not. allocated(error)) call new_machine(machine, motion, records, input, error)
   if (allocated(error)) error stop 1
   print "(a, i0)", "coordinates: ", size(machine%coordinate)

end program consumer
