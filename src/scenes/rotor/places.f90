!! Names of a rotor scene: shafts, nodes and coordinates.
module razy_scenes_rotor_places
   use razy_core_error, only: error_t
   use razy_core_number, only: to_text
   use razy_core_text, only: did_you_mean, excerpt, lower, string_t, texts_of
   use razy_input_input, only: input_t
   use razy_rotor_numbering, only: coordinate_names
   use razy_rotor_rotor, only: rotor_t
   implicit none(type, external)
   private

   public :: find_ends, find_named, find_node, find_place, find_shaft

contains

   !> The shaft or wheel that `name`, a value of `key`, means; or the housing, if they are asked for too.
   subroutine find_shaft(rotor, input, group, i, key, name, housings, shaft, error)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key, name
      integer, intent(in) :: i
      logical, intent(in) :: housings
      integer, intent(out) :: shaft
      type(error_t), allocatable, intent(out) :: error

      logical :: asked(size(rotor%shaft))

      asked = rotor%shaft%turns .or. housings
      shaft = findloc(asked .and. [(lower(rotor%shaft(shaft)%name) == lower(name), shaft=1, size(asked))], .true., dim=1)
      if (shaft == 0) call input%complain(error, group, i, key, "no shaft is named "//excerpt(name)//"; "// &
                                          did_you_mean(name, texts_of(pack(rotor%shaft%name, asked)), "shafts"))
   end subroutine find_shaft

   !> Shaft and node of a part with the keys `shaft` and `node`.
   subroutine find_node(rotor, input, group, i, shaft, node, error)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      integer, intent(out) :: shaft, node
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name

      node = 0
      call input%get(group, i, "shaft", name)
      call find_shaft(rotor, input, group, i, "shaft", name, .true., shaft, error)
      if (allocated(error)) return
      call input%get(group, i, "node", node)
      if (node > rotor%shaft(shaft)%nodes()) then
         call input%complain(error, group, i, "node", "1 to "//to_text(rotor%shaft(shaft)%nodes())//", the nodes of "//name)
      end if
   end subroutine find_node

   !> Shaft, node and which of the six coordinates a value such as 'input.8.phi' of `key` means.
   subroutine find_named(rotor, input, group, i, key, shaft, node, which, error)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      integer, intent(out) :: shaft, node, which
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name
      integer :: dot, own

      shaft = 0
      node = 0
      call input%get(group, i, key, name)
      shaft = findloc([(lower(rotor%shaft(which)%name) == lower(name), which=1, size(rotor%shaft))], .true., dim=1)
      own = findloc(rotor%support%shaft, shaft, dim=1, back=.true.)
      if (shaft > 0 .and. own > 0) then
         ! A body with one coordinate.
         node = 1
         which = findloc(rotor%support(own)%fixed, .false., dim=1)
         if (rotor%shaft(shaft)%rigid .and. count(rotor%support(own)%fixed) == 5) return
      end if
      dot = index(name, ".", back=.true.)
      which = findloc(coordinate_names, lower(name(dot + 1:)), dim=1)
      associate (place => name(:max(0, dot - 1)))
         if (split_place(place) == 0 .and. .not. any(rotor%shaft%name == place .and. rotor%shaft%rigid)) which = 0
      end associate
      if (which == 0) then
         call input%complain(error, group, i, key, "shaft, node and one of u, v, w, phi, theta, psi, such as '"// &
                             trim(rotor%shaft(1)%name)//".1.phi', or a housing and one of these")
         return
      end if
      call find_place(rotor, input, group, i, key, name(:dot - 1), shaft, node, error)
   end subroutine find_named

   !> Shaft and node that a text such as 'input.8', a value of `key`, means.
   subroutine find_place(rotor, input, group, i, key, text, shaft, node, error)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key, text
      integer, intent(in) :: i
      integer, intent(out) :: shaft, node
      type(error_t), allocatable, intent(out) :: error

      integer :: dot, status

      shaft = 0
      node = 0
      dot = split_place(text)
      if (dot == 0 .and. any(rotor%shaft%name == text .and. rotor%shaft%rigid)) then
         shaft = findloc(rotor%shaft%name, text, 1)
         node = 1
         return
      end if
      if (dot == 0) call input%complain(error, group, i, key, "shaft and node, such as '"//trim(rotor%shaft(1)%name)//".1'")
      if (allocated(error)) return
      read (text(dot + 1:), *, iostat=status) node
      if (status /= 0) node = 0
      call find_shaft(rotor, input, group, i, key, text(:dot - 1), .true., shaft, error)
      if (allocated(error)) return
      if (node < 1 .or. node > rotor%shaft(shaft)%nodes()) then
         call input%complain(error, group, i, key, "a node from 1 to "//to_text(rotor%shaft(shaft)%nodes())//", the nodes of "// &
                             trim(rotor%shaft(shaft)%name))
      end if
   end subroutine find_place

   !> Where the dot stands in a text such as 'input.8': a name, and a number of at most 8 digits; 0 in any other text.
   pure function split_place(text) result(dot)
      character(*), intent(in) :: text
      integer :: dot

      integer :: digits

      dot = index(text, ".", back=.true.)
      digits = len(text) - dot
      if (dot < 2 .or. digits < 1 .or. digits > 8) dot = 0
      if (verify(text(dot + 1:), "0123456789") > 0) dot = 0
   end function split_place

   !> Shaft and node, 0 for the frame, of both ends of a group.
   subroutine find_ends(shaft, node, rotor, input, group, i, error)
      integer, intent(out) :: shaft(2), node(2)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)
      integer :: end

      shaft = 0
      node = 0
      call input%get(group, i, "between", names)
      if (size(names) > 2) call input%complain(error, group, i, "between", "two places, not several pairs, beside shafts")
      do end = 1, 2
         if (allocated(error)) return
         if (lower(names(end)%text) == "frame") cycle
         call find_place(rotor, input, group, i, "between", names(end)%text, shaft(end), node(end), error)
      end do
      if (.not. allocated(error) .and. shaft(1) == shaft(2)) then
         call input%complain(error, group, i, "between", "nodes of two different shafts, or a node and 'frame'")
      end if
   end subroutine find_ends

end module razy_scenes_rotor_places
