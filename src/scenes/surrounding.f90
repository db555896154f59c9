!! Stops that stand around one place: flat faces, which are no ring.
!!
!! A closed face pushes along its own direction. Between two faces the gap is larger than that of a ring, and where two of them
!! touch they push together; with ever more faces the motion does not come to that in a ring.
module razy_scenes_surrounding
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, join, lower, string_t
   use razy_input_input, only: input_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: note_surrounding

contains

   !> Add a caution for each place that stops of the input surround: three or more directions, none of which a half plane holds.
   subroutine note_surrounding(machine, input)
      type(machine_t), intent(inout) :: machine
      type(input_t), intent(in) :: input

      real(wp), allocatable :: angle(:)
      type(string_t), allocatable :: ends(:)
      type(string_t) :: place(input%count("stop"))
      logical :: seen(size(place))
      integer :: i, j

      do i = 1, size(place)
         call input%get("stop", i, "between", ends)
         place(i)%text = lower(join(ends, " and "))
      end do
      seen = .false.
      if (.not. allocated(machine%caution)) allocate (machine%caution(0))
      do i = 1, size(seen)
         if (seen(i)) cycle
         angle = [real(wp) ::]
         do j = i, size(seen)
            if (seen(j)) cycle
            seen(j) = place(j)%text == place(i)%text
            if (seen(j) .and. input%given("stop", j, "direction")) angle = [angle, angle_of(input, j)]
         end do
         if (surround(angle)) then
            call append_text(machine%caution, to_text(size(angle))//" stops around "//place(i)%text//" ('"// &
                             input%text("stop", i, "name")//"' and others) are flat faces: what touches two of them is "// &
                             "pushed by both; a round hole is a &ring")
         end if
      end do
   end subroutine note_surrounding

   !> The angle of the direction of stop i in the plane (the last two of three components).
   function angle_of(input, i) result(angle)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      real(wp) :: angle

      real(wp), allocatable :: given(:)

      call input%get("stop", i, "direction", given)
      angle = atan2(given(size(given)), given(size(given) - 1))
   end function angle_of

   !> Whether no half plane holds directions of these angles.
   pure logical function surround(angle)
      real(wp), intent(in) :: angle(:)

      real(wp) :: after
      integer :: i

      surround = size(angle) > 2
      do i = 1, size(angle)
         ! To the next one, anticlockwise; a half turn is one to rounding.
         after = minval(modulo(angle - angle(i), 2*pi), mask=modulo(angle - angle(i), 2*pi) > 8*epsilon(pi))
         surround = surround .and. after < pi*(1 - 8*epsilon(pi))
      end do
   end function surround

end module razy_scenes_surrounding
