!! Modes, critical speeds and stability limit in words for the user.
module modes_words
   use command_line, only: decimal
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, string_t
   use razy_io_modes_file, only: modes_content_t
   use razy_io_modes_reduction, only: reduction_content_t
   implicit none(type, external)
   private

   public :: words_of

   !> More of a kind than this are counted, not listed.
   integer, parameter :: most_lines = 20
   !> Shares below this are not named; nor is whirl.
   real(wp), parameter :: named = 0.1_wp
   !> Directions of whirl above this are called forward, below its negative backward.
   real(wp), parameter :: round = 0.5_wp

contains

   !> The answer in lines.
   function words_of(content) result(lines)
      type(modes_content_t), intent(in) :: content
      type(string_t), allocatable :: lines(:)

      integer :: i

      allocate (lines(0))
      do i = 1, min(most_lines, size(content%natural))
         call append_text(lines, "mode "//to_text(i)//": "//decimal(content%natural(i), 3)//" Hz, "//nature(content, i))
      end do
      if (size(content%natural) > most_lines) call append_text(lines, "and "//to_text(size(content%natural) - most_lines)// &
                                                               " more modes")
      if (allocated(content%reduction)) call append_reduction(lines, content%reduction)
      if (.not. allocated(content%critical)) return
      do i = 1, min(most_lines, size(content%critical))
         call append_text(lines, "critical speed of order "//to_text(content%critical_order(i))//": "// &
                          decimal(content%critical(i), 3)//" rad/s = "//decimal(content%critical(i)*30/pi, 2)//" rpm, "// &
                          decimal(content%critical_frequency(i), 3)//" Hz, "//turning(content%critical_direction(i)))
      end do
      if (size(content%critical) > most_lines) call append_text(lines, "and "//to_text(size(content%critical) - most_lines)// &
                                                                " more critical speeds")
      if (content%lost > 0) call append_text(lines, to_text(int(content%lost))// &
                                             " critical speeds were not located: take more points")
      if (content%limit_words == "found") then
         call append_text(lines, "stability limit: "//decimal(content%limit, 3)//" rad/s = "// &
                          decimal(content%limit*30/pi, 2)//" rpm")
      else
         call append_text(lines, "stability limit: "//content%limit_words)
      end if
   end function words_of

   !> The parts with a share in a mode, largest first, and the mesh.
   function nature(content, mode) result(text)
      type(modes_content_t), intent(in) :: content
      integer, intent(in) :: mode
      character(:), allocatable :: text

      real(wp) :: share(size(content%part))
      integer :: k, place

      share = content%share(:, mode)
      text = ""
      do k = 1, size(share)
         place = maxloc(share, dim=1)
         if (share(place) < named) exit
         if (len(text) > 0) text = text//", "
         text = text//trim(content%part(place))//" "//to_text(nint(100*share(place)))//" %"
         share(place) = 0.0_wp
      end do
      if (.not. allocated(content%strain_share)) return
      do k = 1, size(content%shaft)
         if (size(content%shaft) == 1 .or. content%shaft_share(k, mode) < named) cycle
         text = text//"; "//trim(content%shaft(k))//" "//to_text(nint(100*content%shaft_share(k, mode)))//" %"
      end do
      associate (mesh => content%strain_share(3, mode))
         if (mesh >= named) text = text//"; "//to_text(nint(100*mesh))//" % of the strain energy in the mesh"
      end associate
   end function nature

   !> The largest errors of reduced models.
   subroutine append_reduction(lines, reduction)
      type(string_t), allocatable, intent(inout) :: lines(:)
      type(reduction_content_t), intent(in) :: reduction

      integer :: i

      do i = 1, size(reduction%name)
         call append_text(lines, trim(reduction%name(i))//", "//to_text(int(reduction%coordinates(i)))// &
                          " coordinates, errors against the unreduced model: static mesh compliance "//percent(1)//", "// &
                          to_text(count(reduction%moves == 1))//" frequencies of modes that move the mesh "//percent(2)// &
                          ", transfer function at the mesh up to "//decimal(maxval(reduction%hertz), 0)//" Hz "//percent(3))
      end do

   contains

      function percent(k)
         integer, intent(in) :: k
         character(:), allocatable :: percent

         percent = decimal(100*reduction%error(k, i), 4)//" %"
      end function percent

   end subroutine append_reduction

   pure function turning(direction) result(word)
      real(wp), intent(in) :: direction
      character(:), allocatable :: word

      word = "mixed whirl"
      if (abs(direction) < named) word = "no whirl"
      if (direction > round) word = "forward"
      if (direction < -round) word = "backward"
   end function turning

end module modes_words
