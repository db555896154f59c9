!! Machines of planar scenes for tests, from texts and from the input of the vibropress.
module planar_samples
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_input_input, only: input_t
   use razy_machine_machine, only: machine_t
   use razy_scenes_case, only: motion_t, new_machine, read_study
   use razy_scenes_factory, only: draw_scene
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: read_machine, vibropress

contains

   subroutine read_machine(text, machine, set, drawing)
      character(*), intent(in) :: text
      type(machine_t), intent(out) :: machine
      character(*), intent(in), optional :: set(:)
      type(drawing_t), allocatable, intent(out), optional :: drawing

      class(scene_t), allocatable :: scene
      type(input_t) :: input
      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)
      type(error_t), allocatable :: error
      type(string_t), allocatable :: overrides(:)
      integer :: i

      allocate (overrides(0))
      if (present(set)) then
         deallocate (overrides)
         allocate (overrides(size(set)))
         do i = 1, size(set)
            overrides(i)%text = trim(set(i))
         end do
      end if
      call read_study(input, text, "case.nml", overrides, error)
      if (.not. allocated(error)) call new_machine(machine, motion, records, input, error, scene)
      if (present(drawing) .and. .not. allocated(error)) call draw_scene(scene, drawing, input, error)
      if (allocated(error)) error stop error%message
   end subroutine read_machine

   subroutine vibropress(machine, set, drawing)
      type(machine_t), intent(out) :: machine
      character(*), intent(in), optional :: set(:)
      type(drawing_t), allocatable, intent(out), optional :: drawing

      type(error_t), allocatable :: error
      character(:), allocatable :: text

      call read_text_file("data/vibropress.nml", text, error)
      if (allocated(error)) error stop error%message
      call read_machine(text, machine, set, drawing)
   end subroutine vibropress

end module planar_samples
